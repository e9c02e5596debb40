"""Figure 12: range images of a corner by every technique (Sec. 6.2)."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_experiments.paper import coded_corner, style
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS, Array, Bench, ReconstructedShot
from transientcam_experiments.paper.contenders import Contender
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state

DATA: Final = Sequence(harmonics=4, base_frequency_hz=23e6, takes=4)
"""The paper's data set: "f = 23 MHz and 4 averaged takes (without outliers)"."""
MORE: Final = Sequence(harmonics=8, base_frequency_hz=11.5e6, takes=4)
"""For those that need more frequencies."""
OUTLIER_M: Final = 0.1
_F, _HALF = DATA.base_frequency_hz, MORE.base_frequency_hz
ENTRIES: Final = (
    Contender("single-frequency", _F, 1), Contender("godbaz", _F, 4),
    Contender("maximum-entropy", _F, 3), Contender("pisarenko", _F, 4),
    Contender("maximum-entropy", _F, 4), Contender("pisarenko", _F, 3),
    Contender("pisarenko-merged", _F, 4), Contender("likelihood", _F, 3),
    Contender("dorrington", _F, 2), Contender("sra", _F, 3), Contender("sra-table", _F, 3),
    Contender("logarithmic", _F, 3), Contender("high-frequency", _F, 4),
    Contender("inverse-fourier", _F, 4), Contender("regularised", _F, 4),
    Contender("spumic", _HALF, 6), Contender("coded", _HALF, 8),
    Contender("matrix-pencil", _HALF, 7), Contender("matching-pursuit", _HALF, 8),
    Contender("frequency-domain", _HALF, 8), Contender("maximum-entropy", _HALF, 8),
    Contender("pisarenko", _HALF, 8),
)  # fmt: skip
"""The paper's four first, then the others with its data, then those with more frequencies."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranged:
    """A technique's ranges (H, W) in m, NaN where it finds none, and the true ones."""

    entry: Contender
    range_m: Array
    truth_m: Array

    @property
    def error_m(self) -> Array:
        """Error (N) of the pixels that have a range."""
        error: Array = (self.range_m - self.truth_m)[np.isfinite(self.range_m)]
        return error

    @property
    def rms_m(self) -> float:
        """Of all pixels that have a range."""
        return float(np.sqrt(np.mean(self.error_m**2)))

    @property
    def median_m(self) -> float:
        """Of the absolute error."""
        return float(np.median(np.abs(self.error_m)))

    @property
    def bias_m(self) -> float:
        """Median error."""
        return float(np.median(self.error_m))

    @property
    def outliers(self) -> float:
        """Share of pixels further off than a tenth of a metre, or without a range."""
        off = ~(np.abs(self.range_m - self.truth_m) <= OUTLIER_M)
        return float(off.mean())


def make(bench: Bench) -> FigureResult:
    """Capture the corner twice, and find its ranges by every technique."""
    step = bench.few(4, 16)
    shots = {
        sequence.base_frequency_hz: bench.shot("corner", sequence, options=WITHOUT_OUTLIERS)
        for sequence in (DATA, MORE)
    }
    ranged = [
        _coded(entry, bench, step)
        if entry.technique.measures == "code"
        else ranged_by(entry, shots[entry.base_frequency_hz], step)
        for entry in ENTRIES
    ]
    shot = shots[_F]
    direction = directions(shot)[:, ::step, ::step]
    return FigureResult(
        _draw(ranged, direction), _statements(ranged, shot), (_table(ranged),), _remarks(ranged)
    )


def ranged_by(entry: Contender, shot: ReconstructedShot, step: int) -> Ranged:
    """Return the range of every ``step``-th pixel both ways by a technique."""
    b = np.asarray(shot.found.smoothed)[: entry.m + 1, ::step, ::step].astype(np.complex128)
    phase_rad = entry.estimate(b).first_phase_rad()
    range_m = tm.range_m(phase_rad, shot.base_frequency_hz)
    return Ranged(entry, np.asarray(range_m), shot.truth.first_return_m[::step, ::step])


def _coded(entry: Contender, bench: Bench, step: int) -> Ranged:
    """Capture as the technique requires."""
    captured = coded_corner.capture(bench)
    return Ranged(entry, captured.range_m(step), captured.truth_m[::step, ::step])


def directions(shot: ReconstructedShot) -> Array:
    """Return unit vectors (3, H, W) of the pixels' lines of sight: x right, y away, z up."""
    height, width = shot.lit.shape
    pixel = 2 * np.tan(np.radians(_FIELD_OF_VIEW_DEG) / 2) / width
    x, z = np.meshgrid(
        (np.arange(width) - (width - 1) / 2) * pixel, ((height - 1) / 2 - np.arange(height)) * pixel
    )
    lines = np.stack([x, np.ones_like(x), z])
    return np.asarray(lines / np.linalg.norm(lines, axis=0))


_FIELD_OF_VIEW_DEG: Final = 40.0
"""As the scene has it."""


def _of(ranged: list[Ranged], name: str, m: int) -> Ranged:
    return next(each for each in ranged if (each.entry.name, each.entry.m) == (name, m))


def _statements(ranged: list[Ranged], shot: ReconstructedShot) -> list[Statement]:
    single, godbaz = _of(ranged, "single-frequency", 1), _of(ranged, "godbaz", 4)
    maximum, pisarenko = _of(ranged, "maximum-entropy", 3), _of(ranged, "pisarenko", 4)
    return [
        state(
            "12.rate",
            1 / (shot.applied.capture_s / shot.applied.sequence.takes * DATA.takes),
            at_least=2.2 * 0.95,
            at_most=2.2 * 1.05,
        ),
        state("12.overestimated", single.bias_m),
        state("12.dirac_reduces", godbaz.median_m / single.median_m),
        state("12.dirac_not_robust", godbaz.outliers, outlier_m=OUTLIER_M),
        state("12.entropy_reduces", maximum.rms_m / single.rms_m),
        state("12.entropy_robust", maximum.outliers, outlier_m=OUTLIER_M),
        state(
            "12.pisarenko_outliers",
            100 * (pisarenko.outliers - maximum.outliers),
            outlier_m=OUTLIER_M,
        ),
        state("12.zeroth_benefits", maximum.rms_m / pisarenko.rms_m),
    ]


def _table(ranged: list[Ranged]) -> Table:
    rows = [
        {
            "technique": each.entry.label,
            "m": each.entry.m,
            "MHz": each.entry.frequencies,
            "RMS / mm": 1e3 * each.rms_m,
            "median absolute error / mm": 1e3 * each.median_m,
            "median error / mm": 1e3 * each.bias_m,
            f"off by more than {OUTLIER_M:g} m, or none / %": 100 * each.outliers,
        }
        for each in sorted(ranged, key=lambda each: each.rms_m)
    ]
    return Table.of("Error of the range of the corner", rows)


def _remarks(ranged: list[Ranged]) -> list[str]:
    best = _of(ranged, "maximum-entropy", 3)
    same = [each for each in ranged if each.entry.base_frequency_hz == _F]
    title = f"With the paper's data set (f = {_F / 1e6:g} MHz, m up to 4)"
    remarks = [_beaten(title, same, each) for each in (best, _of(ranged, "pisarenko", 4))]
    coded = next((each for each in ranged if each.entry.technique.measures == "code"), None)
    if coded is not None:
        highest_mhz = coded_corner.HARMONICS * coded.entry.m * _HALF / 1e6
        remarks.append(
            "Coded modulation is captured in its own way: the simulated camera takes the first "
            f"{coded_corner.HARMONICS} harmonics of the code as its waveform and repeats it at "
            f"{coded.entry.m} frequencies, {coded_corner.SEQUENCE.images_per_take} images a take. "
            f"That device is ideal and modulates up to {highest_mhz:g} MHz, where the paper's "
            "model of camera reaches about 100 MHz and errs as everywhere else on this page."
        )
    more = [each for each in ranged if each.entry.base_frequency_hz == _HALF]
    title = f"With f = {_HALF / 1e6:g} MHz, m up to 8"
    return remarks + [_beaten(title, more, each) for each in more if _own(each)]


def _own(each: Ranged) -> bool:
    return each.entry.name in ("maximum-entropy", "pisarenko")


def _name(each: Ranged) -> str:
    return f"{each.entry.label} (m = {each.entry.m})"


def _beaten(title: str, among: list[Ranged], best: Ranged) -> str:
    """Return a remark on the rivals with a smaller error than a method of the paper."""
    rivals = sorted((each for each in among if not _own(each)), key=lambda each: each.rms_m)
    text = f"**{title}**: {_name(best)} has an RMS error of {1e3 * best.rms_m:.1f} mm"
    better = [
        f"{_name(each)} with {1e3 * each.rms_m:.1f} mm"
        for each in rivals
        if each.rms_m < best.rms_m
    ]
    median = [
        f"{_name(each)} with {1e3 * each.median_m:.1f} mm"
        for each in rivals
        if each.median_m < best.median_m
    ]
    text += "; better: " + ", ".join(better) if better else "; no rival is better"
    text += f". Its median absolute error is {1e3 * best.median_m:.1f} mm"
    text += "; smaller: " + ", ".join(median) if median else "; no rival's is smaller"
    return f"{text}."


def _draw(ranged: list[Ranged], direction: Array) -> Any:
    columns = 4
    rows = -(-len(ranged) // columns)
    with style.new(11.0, 2.5 * rows) as picture:
        panels = picture.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat[len(ranged) :]:
            axes.set_visible(False)
        for axes, each in zip(panels.flat, ranged, strict=False):
            _draw_one(axes, each, direction)
        for axes in panels[-1]:
            axes.set_xlabel("x / m")
        for axes in panels[:, 0]:
            axes.set_ylabel("depth / m")
    return picture


def _draw_one(axes: Any, each: Ranged, direction: Array) -> None:
    """Draw the points from above, and the walls as a line."""
    points = direction * each.range_m
    axes.plot(points[0], points[1], ".", color=style.OURS, markersize=1.6, alpha=0.5)
    true = direction * each.truth_m
    order = np.argsort(true[0].ravel())
    axes.plot(true[0].ravel()[order], true[1].ravel()[order], color="black", linewidth=1.2)
    name, _, rest = each.entry.label.partition(" (")
    name = f"{name}\n({rest}" if rest else name.replace(", ", "\n")
    frequency = f"{each.entry.base_frequency_hz / 1e6:g} MHz, m = {each.entry.m}"
    axes.set_title(f"{name}\n{frequency}: RMS {1e3 * each.rms_m:.0f} mm", fontsize=8)
    axes.set(xlim=(-0.8, 0.8), ylim=(1.3, 2.9))


FIGURE: Final = figure(12, make)
