"""Figure 14: direct and indirect light in a transient video (Sec. 5.1, 6.3)."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, Options, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.visitor import MOMENTS_S, VIDEO, parts, video

_OUTLIER: Final = 0.2
"""Share of a pixel's light that is put to the wrong side in an outlier."""
_AMBIENT: Final[Options] = {"ambient": "on"}


def make(bench: Bench) -> FigureResult:
    """Separate the frames of Figure 13, and once more by daylight."""
    frames = {at_s: pair[0] for at_s, pair in video(bench).items()}
    daylight = bench.shot("visitor", VIDEO, at_s=MOMENTS_S[0], options=_AMBIENT)
    return FigureResult(
        _draw(frames), _statements(list(frames.values()), daylight), (_table(frames),)
    )


def _mirrored(shot: ReconstructedShot) -> Array:
    """Return the pixels of the wall with light over both mirrors."""
    return parts(shot)["wall over two mirrors"]


def _wrong(shot: ReconstructedShot) -> Array:
    """Return the error (H, W) of the indirect light over the brightness."""
    true = shot.truth.brightness - shot.truth.direct
    error: Array = (np.asarray(shot.found.indirect) - true) / np.maximum(
        shot.truth.brightness, 1e-30
    )
    return error


def _outliers(shot: ReconstructedShot) -> float:
    """Return the share of lit pixels with much light on the wrong side."""
    return float((np.abs(_wrong(shot))[shot.lit] > _OUTLIER).mean())


def _time_errors_s(shot: ReconstructedShot) -> tuple[Array, Array]:
    """Return the errors (H, W) of the time of the direct return: Pisarenko's, one frequency's."""
    turn = 2 * np.pi * shot.base_frequency_hz
    single = np.remainder(np.angle(shot.found.moments[1]), 2 * np.pi)
    ours = np.asarray(shot.found.phase_rad) / turn - shot.truth.delay_s[0]
    return ours, single / turn - shot.truth.delay_s[0]


def _statements(shots: list[ReconstructedShot], daylight: ReconstructedShot) -> list[Statement]:
    mirrored = [_mirrored(shot) for shot in shots]
    wrong = np.concatenate(
        [np.abs(_wrong(shot))[where] for shot, where in zip(shots, mirrored, strict=True)]
    )
    outliers = float(np.mean([_outliers(shot) for shot in shots]))
    ours, single = (
        np.concatenate(
            [
                np.abs(_time_errors_s(shot)[k])[where]
                for shot, where in zip(shots, mirrored, strict=True)
            ]
        )
        for k in range(2)
    )
    brightness = np.concatenate(
        [
            np.abs(shot.found.brightness[shot.lit] / shot.truth.brightness[shot.lit] - 1)
            for shot in shots
        ]
    )
    lit = daylight.lit
    change = daylight.found.brightness[lit].sum() / shots[0].found.brightness[lit].sum() - 1
    return [
        state("14.separated", float(np.nanmedian(wrong))),
        state(
            "14.outliers",
            outliers,
            outlier=_OUTLIER,
            at_s=MOMENTS_S[1],
            standing=_outliers(shots[1]),
        ),
        state("14.free", float(np.nanmedian(ours) / np.nanmedian(single))),
        state("14.sum", float(np.nanmedian(brightness))),
        state("14.active", float(abs(change))),
    ]


def _table(frames: dict[float, ReconstructedShot]) -> Table:
    rows = []
    for at_s, shot in frames.items():
        where = _mirrored(shot)
        wrong = np.abs(_wrong(shot))[where]
        ours_mm, single_mm = (
            float(tm.SPEED_OF_LIGHT_M_S * np.nanmedian(np.abs(each)[where]) / 2 * 1e3)
            for each in _time_errors_s(shot)
        )
        rows.append(
            {
                "time / s": at_s,
                "median error of indirect light / %": 100 * float(np.nanmedian(wrong)),
                f"pixels with more than {_OUTLIER:.0%} wrong / %": 100 * _outliers(shot),
                "median error of range / mm": ours_mm,
                "by a single frequency / mm": single_mm,
            }
        )
    return Table.of("Pixels with light over both mirrors (outliers: all lit pixels)", rows)


def _draw(frames: dict[float, ReconstructedShot]) -> Any:
    rows: tuple[tuple[str, Callable[[ReconstructedShot], Any]], ...] = (
        ("direct and indirect", lambda shot: shot.found.direct + shot.found.indirect),
        ("direct", lambda shot: shot.found.direct),
        ("indirect", lambda shot: shot.found.indirect),
        ("time of the direct return", _time_ns),
    )
    with style.new(9.5, 9.4) as picture:
        panels = picture.subplots(4, len(frames))
        most = max(float(np.percentile(shot.truth.brightness, 99)) for shot in frames.values())
        for number, (name, image_of) in enumerate(rows):
            last = number == len(rows) - 1
            for axes, (at_s, shot) in zip(panels[number], frames.items(), strict=True):
                style.show(
                    axes,
                    np.asarray(image_of(shot)),
                    f"{name}, t = {at_s:g} s",
                    colours=style.DEPTH if last else style.LIGHT,
                    least=9.0 if last else 0.0,
                    most=16.0 if last else most,
                )
            style.scale(picture, list(panels[number]), "ns" if last else "DN")
    return picture


def _time_ns(shot: ReconstructedShot) -> Array:
    time_ns: Array = np.asarray(shot.found.phase_rad) / (2 * np.pi * shot.base_frequency_hz) * 1e9
    return time_ns


FIGURE: Final = figure(14, make)
