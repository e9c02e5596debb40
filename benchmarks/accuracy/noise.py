"""Noise of single pixels: predicted against observed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.capturing import SEED, captured, short
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.measuring import spec_of
from transientcam_server.imaging._errors_of_range.noise import moment_noise
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
_PISARENKO = ReconstructionSettings(estimator="pisarenko")


def predicted_and_observed() -> list[Compared]:
    """Predict the deviation of Pisarenko's range of `mirrors` from its mean frame; observe it."""
    compared = []
    with open_camera(spec_of("mirrors", seed=SEED), clock=VirtualClock()) as camera:
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
    figure = Figure(figsize=(6.4, 5.6), layout="constrained")
    FigureCanvasAgg(figure)
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
    figure.savefig(path, dpi=110, metadata={"Software": None})
