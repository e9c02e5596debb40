"""Statistics of the noise: the mean-variance line, independence, kurtosis."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.tables import Table
from transientcam_driver import Sequence
from transientcam_driver.camera import Sensor
from transientcam_simulation.base import SparseResponses
from transientcam_simulation.imaging import World
from transientcam_simulation.light import GivenScenery

SHAPE = (120, 163)
IMAGES = 60
EXPOSURE_S = 1e-3
LEVELS_E = (200.0, 1_000.0, 4_000.0, 12_000.0, 30_000.0)


def _series(mean_e: float) -> NDArray[np.float64]:
    """Images of an even brightness."""
    ones = np.ones((1, *SHAPE))
    world = World(
        GivenScenery(SparseResponses(0 * ones, ones)),
        Sensor(),
        electrons_per_s=2 * mean_e / EXPOSURE_S,
        effects={},
        seed=5,
    )
    sequence = Sequence(harmonics=1, zeroth="on-off", exposure_s=EXPOSURE_S)
    world.configure(sequence, sequence.labels)
    on = sequence.labels[0]
    images = [world.image(on, number=n, device_time_s=0.0) for n in range(IMAGES)]
    return np.array(images, dtype=np.float64)


def tables() -> Iterator[Table]:
    """Measure images of even light."""
    sensor = Sensor()
    series = [_series(mean_e) for mean_e in LEVELS_E]
    means = [float(each.mean()) - sensor.dark_dn for each in series]
    variances = [float(each.var()) for each in series]
    slope, offset = np.polyfit(means, variances, 1)
    bright = series[-2] - series[-2].mean()
    sideways = np.corrcoef(bright[:, :, 1:].ravel(), bright[:, :, :-1].ravel())[0, 1]
    downwards = np.corrcoef(bright[:, 1:].ravel(), bright[:, :-1].ravel())[0, 1]
    onwards = np.corrcoef(bright[1:].ravel(), bright[:-1].ravel())[0, 1]
    kurtosis = float(np.mean(bright**4) / np.mean(bright**2) ** 2)
    gain = sensor.gain_e_per_dn
    rows = [
        ("slope of variance over mean", f"{slope:.4f} DN", f"{1 / gain:.4f} DN"),
        (
            "variance at no light",
            f"{offset:.2f} DN²",
            f"{(sensor.read_noise_e / gain) ** 2 + 1 / 12:.2f} DN²",
        ),
        ("kurtosis", f"{kurtosis:.3f}", f"3, ± {2 * np.sqrt(24 / bright.size):.3f}"),
        (
            "correlation of neighbours, right and down",
            f"{sideways:.4f}, {downwards:.4f}",
            f"0 ± {2 / np.sqrt(bright.size):.4f}",
        ),
        ("correlation of successive images", f"{onwards:.4f}", "the same"),
    ]
    text = f"Of {IMAGES} images of {len(LEVELS_E)} even levels of light, {bright.size} values each."
    yield Table("", ("what", "measured", "expected"), rows, text=[text])
