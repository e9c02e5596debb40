"""What is predicted of the noise, against the scatter of many frames: of pixels, and by a frame."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.capturing import SEED, captured, short
from benchmarks.common.picture import blank, saved
from benchmarks.common.tables import Cell, Column, Table, heads
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff import camera_before
from transientcam_server.imaging import typical_deviation
from transientcam_server.imaging._errors_of_range.accuracy import range_accuracy
from transientcam_server.imaging._errors_of_range.noise import moment_noise, range_noise
from transientcam_server.settings import ReconstructionSettings


@dataclass(frozen=True)
class Compared:
    """Deviation of the range of many pixels at one setting."""

    sequence: Sequence
    predicted_m: NDArray[Any]
    observed_m: NDArray[Any]
    holds_share: float

    @property
    def ratio(self) -> float:
        """Root mean square of observed over predicted, where first order holds."""
        return float(np.sqrt(np.mean((self.observed_m / self.predicted_m) ** 2)))


NOISE = (
    Sequence(harmonics=1),
    Sequence(harmonics=2),
    Sequence(harmonics=3),
    Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005),
    Sequence(harmonics=3, zeroth="on-off", exposure_s=0.001),
    Sequence(harmonics=3, takes=4, exposure_s=0.001),
    Sequence(harmonics=3, takes=16),
)
FRAMES = 60
STATING = ("wall", "corner", "mirrors")
STATED_FRAMES = 40
_PISARENKO = ReconstructionSettings(estimator="pisarenko", neighbours="gaussian")


def predicted_and_observed() -> list[Compared]:
    """Predict the deviation of Pisarenko's range of `mirrors` from its mean frame; observe it."""
    compared = []
    with camera_before("mirrors", seed=SEED) as camera:
        for sequence in NOISE:
            recipe, found = captured(camera, sequence, FRAMES, _PISARENKO)
            noise = moment_noise(recipe, found[0])
            mean = np.mean([each.smoothed for each in found], axis=0)
            predicted = tm.noise.return_noise(tm.pisarenko(mean), noise)
            ranges = np.stack([np.asarray(each.range_m, dtype=float) for each in found])
            holds = predicted.holds & np.isfinite(ranges).all(axis=0)
            std_m = tm.range_m(predicted.direct_phase_std_rad, recipe.base_frequency_hz)
            compared.append(
                Compared(
                    sequence,
                    np.asarray(std_m)[holds],
                    ranges.std(axis=0, ddof=1)[holds],
                    float(holds.mean()),
                )
            )
    return compared


def draw_noise(compared: list[Compared], path: Path) -> None:
    """Draw observed against predicted deviations, a point a pixel."""
    figure = blank(6.4, 5.6)
    panel = figure.subplots()
    ends = (1e-4, 1e-1)
    panel.fill_between(
        ends,
        [0.85 * end for end in ends],
        [1.15 * end for end in ends],
        color="0.85",
        label="within 15 %",
    )
    for number, each in enumerate(compared):
        panel.plot(
            each.predicted_m[::7],
            each.observed_m[::7],
            ".",
            markersize=2,
            color=f"C{number}",
            label=short(each.sequence),
        )
    panel.set(
        xscale="log",
        yscale="log",
        xlim=ends,
        ylim=ends,
        xlabel="predicted standard deviation of the range / m",
        ylabel=f"observed in {FRAMES} captures / m",
        title="Noise of single pixels by Pisarenko, where first order holds",
    )
    panel.legend(fontsize="small", markerscale=5)
    panel.grid(alpha=0.25)
    path.write_bytes(saved(figure, "png"))


def tables(figures: Path) -> Iterator[Table]:
    """Predict noise of pixels, and hold what a frame says of itself against the scatter."""
    compared = predicted_and_observed()
    draw_noise(compared, figures / "noise-prediction.png")
    columns = heads(
        "sequence | holds for:.0% | predicted mm:.3g | observed mm:.3g | rms ratio:.3f | "
        "within 15 %:.0%"
    )
    text = (
        f"Pisarenko's on `mirrors`, from sensor and mean moments to each pixel's deviation, "
        f"against {FRAMES} captures, which know a pixel's deviation to 9 % (so that a perfect "
        "prediction has 89 % of the pixels within 15 %). First order holds with as many returns as "
        "harmonics, all clear of the noise and of each other."
    )
    rows = [
        (
            short(each.sequence),
            each.holds_share,
            np.median(each.predicted_m) * 1e3,
            np.median(each.observed_m) * 1e3,
            each.ratio,
            np.mean(np.abs(each.observed_m / each.predicted_m - 1) < 0.15),
        )
        for each in compared
        if each.predicted_m.size
    ]
    picture = "![Observed against predicted noise](../figures/noise-prediction.png)"
    yield Table("Is the noise predicted?", columns, rows, [picture], [text])
    stated = ("`range_std`", "`predicted_range_std_m`")
    text = (
        f"The default estimator, median pixel: what one frame states, and how {STATED_FRAMES} "
        "frames scatter; behind each figure, how often it is the scatter. `range_std` draws the "
        "noise of the sensor. `predicted_range_std_m` is that of the likelihood's returns to first "
        "order: that noise changes their number, or makes a tail of them, is not in it."
    )
    of_frames = (
        "scene",
        "sequence",
        Column("scatter mm", ".3g"),
        *(f"{each} mm" for each in stated),
    )
    yield Table("Does a frame know its noise?", of_frames, list(_stated()), text=[text])


def _stated() -> Iterator[tuple[Cell, ...]]:
    for scene in STATING:
        with camera_before(scene, seed=SEED) as camera:
            for sequence in NOISE:
                recipe, found = captured(camera, sequence, STATED_FRAMES)
                ranges = np.stack([np.asarray(each.range_m, dtype=float) for each in found])
                std_m = range_accuracy(recipe, found[0]).std_m
                known = np.isfinite(ranges).all(axis=0) & np.isfinite(std_m)
                predicted = range_noise(recipe, found[0])
                observed_m = float(np.median(typical_deviation(ranges[:, known])))
                of_frame = np.median(std_m[known]), predicted and predicted["median"]
                said = (f"{1e3 * m:.3g} ({m / observed_m:.2f})" if m else "–" for m in of_frame)
                yield scene, short(sequence), 1e3 * observed_m, *said
