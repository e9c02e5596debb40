"""Figure 15: a streak image, one scanline over time of flight (Sec. 6.4)."""

from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.mirrors import SEQUENCES, shots, thrice

_TIMES_S: Final = np.linspace(9e-9, 31e-9, 881)
_WIDTH: Final = 163
_BINS: Final = 164
_FIRST_S: Final = 12e-9
_APART_S: Final = 0.05e-9
"""By how much returns of a pair are further apart from one column to the next."""
_TRIED: Final = (5, 10, 15, 20, 25, 30, 40, 60, 80, 120, 160)
_SCENE: Final = Path(__file__).with_name("pairs.toml")


def make(bench: Bench) -> FigureResult:
    """Take one row out of the capture of Figure 8b and 9b."""
    shot = shots(bench, SEQUENCES["b"], frames=2)[0]
    row = _scanline(shot)
    line = _line(shot, row)
    streak = 2 * np.pi * shot.base_frequency_hz * tm.density(line, _phase(shot)) * 1e-9
    pairs = _pairs(bench)
    merging = _merging(pairs)
    return FigureResult(
        _draw(shot, row, np.asarray(streak), pairs),
        _statements(shot, row, np.asarray(streak), merging),
        (
            Table(
                "Pairs of returns of 2 : 1, captured with the same sequence",
                ("apart / ns", "pixels in which both peak / %"),
                merging,
            ),
        ),
        (
            "The returns of our scene are nowhere closer than "
            f"{_closest_s(shot, row) * 1e9:.1f} ns on this scanline, and none merge. Where they "
            "would is shown by a scene of pairs that come closer from column to column.",
        ),
    )


def _scanline(shot: ReconstructedShot) -> int:
    """Return the middle row, which crosses the shadows of all three digits."""
    return int(shot.lit.shape[0] // 2)


def _line(shot: ReconstructedShot, row: int) -> tm.Coefficients:
    coefficients = shot.found.coefficients
    return tm.Coefficients(
        coefficients.error[row], coefficients.polynomial[:, row], coefficients.reflection[:, row]
    )


def _phase(shot: ReconstructedShot) -> Array:
    phase: Array = 2 * np.pi * shot.base_frequency_hz * _TIMES_S
    return phase


def _closest_s(shot: ReconstructedShot, row: int) -> float:
    gaps = np.diff(shot.truth.delay_s[:, row], axis=0)
    return float(np.nanmin(gaps))


def _widths_ns(shot: ReconstructedShot, row: int, streak: Array) -> tuple[Array, Array]:
    """Return weight and full width at half maximum in ns of the peaks at the true returns."""
    weights, widths = [], []
    for x in np.flatnonzero(thrice(shot)[row]):
        for delay_s, weight in zip(
            shot.truth.delay_s[:3, row, x], shot.truth.weight[:3, row, x], strict=True
        ):
            near = np.flatnonzero(np.abs(_TIMES_S - delay_s) < 1e-9)
            top = near[streak[near, x].argmax()]
            low = streak[:, x] < streak[top, x] / 2
            before, after = np.flatnonzero(low[:top]), np.flatnonzero(low[top:])
            if before.size and after.size:
                weights.append(weight / shot.truth.brightness[row, x])
                widths.append((after[0] + top - before[-1]) * (_TIMES_S[1] - _TIMES_S[0]) * 1e9)
    return np.array(weights), np.array(widths)


def _pairs(bench: Bench) -> ReconstructedShot:
    """Capture pairs of returns of 2 : 1, further apart in each column of the sensor."""
    columns = np.arange(_WIDTH)
    h = np.zeros((1, _WIDTH, _BINS), dtype=np.float32)
    h[0, columns, 0] = 2 / 3
    h[0, columns, columns] += 1 / 3
    with TemporaryDirectory() as folder:
        np.savez(
            Path(folder) / "pairs.npz",
            h=h,
            start_opl_m=_FIRST_S * SPEED_OF_LIGHT_M_S,
            bin_opl_m=_APART_S * SPEED_OF_LIGHT_M_S,
        )
        scene = Path(folder) / "pairs.toml"
        copyfile(_SCENE, scene)
        return bench.shot(str(scene), SEQUENCES["b"])


def _merging(pairs: ReconstructedShot) -> list[tuple[float, float]]:
    """Return distances in ns, and the share in % of the pixels in which both returns peak."""
    found = tm.peaks(pairs.found.coefficients, threshold=0.0).phase_rad
    turn = 2 * np.pi * pairs.base_frequency_hz
    rows = []
    for column in _TRIED:
        apart = turn * _APART_S * column
        first = turn * _FIRST_S
        peaks = [np.abs(found[:, :, column] - at) < apart / 2 for at in (first, first + apart)]
        both = np.all([each.any(axis=0) for each in peaks], axis=0)
        rows.append((round(_APART_S * column * 1e9, 2), 100 * float(both.mean())))
    return rows


def _statements(
    shot: ReconstructedShot, row: int, streak: Array, merging: list[tuple[float, float]]
) -> list[Statement]:
    weight, width = _widths_ns(shot, row, streak)
    weak, strong = width[weight < 0.2], width[weight > 0.5]
    return [
        state("15.smoothed", float(np.median(weak) / np.median(strong))),
        state("15.merge", merging[0][1] / 100, apart_ns=merging[0][0]),
        state("15.distinct", merging[-1][1] / 100, apart_ns=merging[-1][0]),
    ]


def _draw(shot: ReconstructedShot, row: int, streak: Array, pairs: ReconstructedShot) -> Any:
    middle = _scanline(pairs)
    turn = 2 * np.pi * pairs.base_frequency_hz
    closing = turn * np.asarray(tm.density(_line(pairs, middle), _phase(pairs))) * 1e-9
    with style.new(11.0, 4.4) as picture:
        left, centre, right = picture.subplots(1, 3, width_ratios=(0.8, 1.2, 1.2))
        frame = np.asarray(shot.found.cumulative(np.array([35e-9])))[0]
        style.show(left, frame, "the scanline in (a)")
        left.axhline(row, color=style.TRUTH, linewidth=2.0)
        _draw_streak(centre, streak, "(a) mirrors")
        _draw_streak(right, closing, "(b) pairs, further apart with each column")
        for offset in (0.0, _APART_S):
            at_ns = (_FIRST_S + offset * np.arange(_WIDTH)) * 1e9
            right.plot(at_ns, np.arange(_WIDTH), color="white", linestyle=":", linewidth=0.8)
        right.set(xlim=(10, 22))
        style.scale(picture, [centre, right], "log₁₀ of the density in DN/ns")
    return picture


def _draw_streak(axes: Any, streak: Array, title: str) -> None:
    extent = (_TIMES_S[0] * 1e9, _TIMES_S[-1] * 1e9, streak.shape[1] - 0.5, -0.5)
    # the logarithm, so that broad peaks are seen beside sharp ones
    axes.imshow(
        np.log10(np.maximum(streak.T, 1e-3)),
        extent=extent,
        aspect="auto",
        cmap=style.LIGHT,
        vmin=0.0,
        vmax=4.3,
    )
    axes.set(title=title, xlabel="τ / ns", ylabel="pixel along the scanline")
    axes.grid(visible=False)


FIGURE: Final = figure(15, make)
