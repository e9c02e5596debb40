"""The paper's Fig. 12, on the simulated corner: range by one frequency and by more."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock

BASE_FREQUENCY_HZ = 23e6
TAKES = 4
# name, estimator, m
ESTIMATES = (
    ("single frequency", "single-frequency", 3),
    ("maximum entropy, m = 3", "maximum-entropy", 3),
    ("maximum entropy, m = 4", "maximum-entropy", 4),
    ("Pisarenko, m = 3", "pisarenko", 3),
    ("Pisarenko, m = 4", "pisarenko", 4),
)


@dataclass(frozen=True)
class RangeError:
    """How far an estimate of range is off, over the pixels that it gives a range.

    ``rms_m`` counts everything; ``bias_m`` is the mean, ``median_m`` that of the absolute error,
    ``outliers`` the share that is off by more than 0.1 m.
    """

    name: str
    rms_m: float
    bias_m: float
    median_m: float
    outliers: float
    missing: float


def range_errors(
    camera: str = "sim:corner", *, smoothing_sigma_px: float = 0.6
) -> tuple[RangeError, ...]:
    """Capture the corner as in Fig. 12, and hold each estimate against the truth.

    f = 23 MHz, four takes, the paper's smoothing.
    """
    errors = []
    for name, estimator, harmonics in ESTIMATES:
        images, truth_m, gain = _captured(camera, harmonics)
        settings = tm.Settings(
            base_frequency_hz=BASE_FREQUENCY_HZ,
            zeroth=Sequence().zeroth,
            takes=TAKES,
            estimator=estimator,
            smoothing_sigma_px=smoothing_sigma_px,
        )
        estimate_m = tm.reconstruct(images, settings, calibration=gain).range_m
        errors.append(_error(name, np.asarray(estimate_m, dtype=np.float64), truth_m))
    return tuple(errors)


def _captured(camera: str, harmonics: int) -> tuple[NDArray[Any], NDArray[np.float64], Any]:
    sequence = Sequence(base_frequency_hz=BASE_FREQUENCY_HZ, harmonics=harmonics, takes=TAKES)
    with open_camera(camera, clock=VirtualClock()) as opened:
        opened.configure(sequence)
        opened.start()
        images = opened.read_frame(timeout_s=60).images
        assert opened.simulation is not None
        truth_m = opened.simulation.truth().range_m
    sub_phases = sequence.sub_phases
    gain = tm.nominal_calibration(
        harmonics, sub_phases.phases_rad, sub_phases.weights, zeroth=sequence.zeroth
    )
    return images, truth_m, gain


def _error(name: str, estimate_m: NDArray[np.float64], truth_m: NDArray[np.float64]) -> RangeError:
    there = np.isfinite(estimate_m)
    error_m = (estimate_m - truth_m)[there]
    return RangeError(
        name,
        rms_m=float(np.sqrt(np.mean(error_m**2))),
        bias_m=float(np.mean(error_m)),
        median_m=float(np.median(np.abs(error_m))),
        outliers=float(np.mean(np.abs(error_m) > 0.1)),
        missing=1 - float(np.mean(there)),
    )


@pytest.fixture(scope="module")
def errors() -> dict[str, RangeError]:
    return {each.name: each for each in range_errors()}


def test_interreflection_makes_one_frequency_see_the_corner_too_far(
    errors: dict[str, RangeError],
) -> None:
    single = errors["single frequency"]

    assert single.bias_m > 0.05
    assert single.bias_m > 0.9 * single.rms_m  # nearly all of the error is bias


def test_maximum_entropy_takes_most_of_the_error_away(errors: dict[str, RangeError]) -> None:
    single, proposed = errors["single frequency"], errors["maximum entropy, m = 3"]

    assert proposed.rms_m < single.rms_m / 3
    assert proposed.outliers < 0.01


def test_pisarenko_is_right_in_most_pixels_and_far_off_in_some(
    errors: dict[str, RangeError],
) -> None:
    """ "The Pisarenko estimate suffers from severe outliers" (Sec. 6.2)."""
    sparse, proposed = errors["Pisarenko, m = 4"], errors["maximum entropy, m = 4"]

    assert sparse.median_m < 0.03
    assert sparse.outliers > proposed.outliers + 0.01


def test_without_interreflection_one_frequency_is_right() -> None:
    single = range_errors("sim:corner?interreflection=off")[0]

    assert single.rms_m < 0.005
