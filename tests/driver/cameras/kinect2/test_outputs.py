"""Infrared and depth of whole frames, against those that libfreenect2 stored."""

import numpy as np
import pytest

import transientcam_moments as tm
from benchmarks.kinect2.decoding import infrared
from tests.driver.cameras.kinect2 import libfreenect2
from tests.driver.cameras.kinect2.conftest import Load
from tests.driver.cameras.kinect2.vectors import MULTIPLES, RADIAN_M, load, noise

pytestmark = pytest.mark.data


@pytest.mark.parametrize("name", ["ramp", "noisy", "two_returns"])
def test_infrared_and_depth_are_libfreenect2s_by_its_own_arithmetic(
    vectors: Load, name: str
) -> None:
    assert vectors(name)  # or skip where there are none
    scene = load(name)

    same, apart_mm = libfreenect2.agreement(scene)

    assert infrared(scene) < 0.03  # of 65 535, in single precision
    assert same == 1.0
    assert apart_mm < 0.1


def test_a_range_of_one_return_is_within_the_steps_of_the_codes(vectors: Load) -> None:
    assert vectors("ramp")
    scene = load("ramp")

    found = tm.unwrap(scene.moments, noise(0.5), harmonics=MULTIPLES)

    off_mm = 1e3 * np.abs(RADIAN_M * np.asarray(found.phase_rad) - scene.path_m / 2)
    assert np.median(off_mm) < 0.3  # libfreenect2's is, at its own speed of light, 2.8
    assert off_mm.max() < 5.0
    assert np.asarray(found.explained()).mean() > 0.99
