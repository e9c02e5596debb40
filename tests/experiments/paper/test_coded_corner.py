"""A code as the simulated camera's waveform gives the samples that its model foresees."""

import numpy as np
import pytest

from transientcam_experiments.paper import Bench, coded_corner
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS
from transientcam_moments.comparisons import maximum_length_code


@pytest.fixture(scope="module")
def capture(bench: Bench) -> coded_corner.CodedCapture:
    return coded_corner.capture(bench)


@pytest.mark.parametrize(("x", "y"), [(40, 60), (120, 30)])
def test_samples_are_odd_harmonics_of_the_scenes_moments(
    capture: coded_corner.CodedCapture, bench: Bench, x: int, y: int
) -> None:
    time_s, light = bench.shot(
        "corner", coded_corner.SEQUENCE, options=WITHOUT_OUTLIERS
    ).truth.impulse_response(x, y)
    contents = maximum_length_code().contents.real
    found = capture.samples[:, y, x]

    expected = []
    for shift in (0.0, np.pi / 2):
        for j in range(1, 9):
            waves = [
                contents[k - 1]
                / contents[0]
                * np.cos(k * (2 * np.pi * 11.5e6 * j * time_s - shift))
                for k in (1, 3, 5, 7, 9)
            ]
            expected.append(float((np.sum(waves, axis=0) * light).sum() / light.sum()))

    # in DN: the scale is the brightness, noise and smoothing leave a few per cent
    scale = found @ np.array(expected) / (np.array(expected) @ np.array(expected))
    assert found / scale == pytest.approx(expected, abs=0.15)
    assert np.corrcoef(found, expected)[0, 1] > 0.995


def test_the_direct_light_of_the_corner_is_found(capture: coded_corner.CodedCapture) -> None:
    error_m = capture.range_m(24) - capture.truth_m[::24, ::24]

    assert np.median(np.abs(error_m)) < 0.03
