"""Figure 13: a transient video, over time of flight and over time (Sec. 6.3)."""

from dataclasses import replace
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.visitor import MOMENTS_S, VIDEO, VIDEO_HZ, parts, video

_TIMES_S: Final = (9.9e-9, 13.8e-9, 24.2e-9)
_LONG_S: Final = 0.00192
_NEAR_S: Final = 1e-9
_FOUND: Final = 0.1
"""Returns below this share of a pixel's light need not be found."""


def make(bench: Bench) -> FigureResult:
    """Capture three moments of the video, and one with the exposure of the other figures."""
    frames = video(bench)
    longer = replace(VIDEO, exposure_s=_LONG_S)
    bright = bench.shots("visitor", longer, frames=2, at_s=MOMENTS_S[0])
    return FigureResult(
        _draw({at_s: pair[0] for at_s, pair in frames.items()}),
        _statements(frames, bright),
        (_table(frames),),
    )


def _density(shot: ReconstructedShot) -> Array:
    return np.asarray(shot.found.density(np.array(_TIMES_S))) * 1e-9


def _noise(pair: list[ReconstructedShot]) -> float:
    """Return the typical relative difference of the direct wave in two frames, on the wall."""
    wall = parts(pair[0])["wall"] & parts(pair[1])["wall"]
    one, other = (_density(shot)[1][wall] for shot in pair)
    bright = one + other > np.percentile(one + other, 75)
    return float(np.median(2 * np.abs(one - other)[bright] / (one + other)[bright]))


def _arrivals_ns(shot: ReconstructedShot) -> dict[str, tuple[float, float]]:
    """Return typical times in ns of the light of each part, and the true ones."""
    turn = 2 * np.pi * shot.base_frequency_hz
    phase = tm.peaks(shot.found.coefficients, threshold=0.0).phase_rad / turn
    arrivals = {}
    for name, where in parts(shot).items():
        true = shot.truth.delay_s[0]
        if name == "wall over two mirrors":
            later = np.where(shot.truth.delay_s > 20e-9, shot.truth.delay_s, np.inf)
            true = later.min(axis=0)
        apart = np.abs(phase - true)
        nearest = np.nan_to_num(apart, nan=np.inf).argmin(axis=0)[None]
        found = np.take_along_axis(phase, nearest, axis=0)[0]
        arrivals[name] = (
            float(np.nanmedian(found[where])) * 1e9,
            float(np.median(true[where])) * 1e9,
        )
    return arrivals


def _complete(shot: ReconstructedShot) -> float:
    """Return the share of lit pixels whose density peaks near every true return."""
    turn = 2 * np.pi * shot.base_frequency_hz
    phase = tm.peaks(shot.found.coefficients, threshold=0.0).phase_rad
    complete = shot.lit.copy()
    for delay_s, weight in zip(shot.truth.delay_s, shot.truth.weight, strict=True):
        required = weight > _FOUND * shot.truth.brightness
        near = (np.abs(phase - turn * delay_s) < turn * _NEAR_S).any(axis=0)
        complete &= near | ~required
    return float(complete[shot.lit].mean())


def _statements(
    frames: dict[float, list[ReconstructedShot]], bright: list[ReconstructedShot]
) -> list[Statement]:
    pairs = list(frames.values())
    interval_s = float(np.mean([pair[1].time_s - pair[0].time_s for pair in pairs]))
    arrivals = [_arrivals_ns(pair[0]) for pair in pairs]
    in_order = min(
        min(np.diff([each[name][0] for name in ("actor", "wall", "wall over two mirrors")]))
        for each in arrivals
    )
    off = max(abs(found - true) for each in arrivals for found, true in each.values())
    return [
        state("13.rate", 1 / interval_s, at_least=VIDEO_HZ - 0.1, at_most=VIDEO_HZ + 0.1),
        state("13.order", float(in_order)),
        state("13.when", off),
        state(
            "13.where",
            float(np.mean([_complete(pair[0]) for pair in pairs])),
            near_ns=_NEAR_S * 1e9,
            found=_FOUND,
        ),
        state("13.noisy", _noise(pairs[0]) / _noise(bright), long_ms=_LONG_S * 1e3),
    ]


def _table(frames: dict[float, list[ReconstructedShot]]) -> Table:
    rows = []
    for at_s, pair in frames.items():
        arrivals = _arrivals_ns(pair[0])
        times = [value for found_true in arrivals.values() for value in found_true]
        rows.append((at_s, *times, 100 * _complete(pair[0]), 100 * _noise(pair)))
    columns = (
        "time / s", "actor / ns", "true", "wall / ns", "true", "over mirrors / ns", "true",
        "complete pixels / %", "difference of two frames / %",
    )  # fmt: skip
    return Table("When light comes back, by part of the scene", columns, rows)


def _draw(frames: dict[float, ReconstructedShot]) -> Any:
    with style.new(11.0, 2.3 * len(frames)) as picture:
        panels = picture.subplots(len(frames), 3)
        densities = {at_s: _density(shot) for at_s, shot in frames.items()}
        for column, time_s in enumerate(_TIMES_S):
            most = float(np.percentile([each[column] for each in densities.values()], 99))
            for row, (at_s, density) in enumerate(densities.items()):
                title = f"t = {at_s:g} s, τ = {time_s * 1e9:.1f} ns"
                style.show(panels[row, column], density[column], title, most=most)
            style.scale(picture, list(panels[:, column]), "DN/ns")
    return picture


FIGURE: Final = figure(13, make)
