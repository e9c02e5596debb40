"""What pixels of four images become, by complex arithmetic."""

from typing import Any, cast

import numpy as np

from transientcam_moments.images import phasors

RANDOM = np.random.default_rng(11)
IMAGES: Any = RANDOM.uniform(0, 4095, (4, 200))
X, Y, U, V = RANDOM.normal(size=(4, 200))


def test_a_phasor_is_the_sum_of_its_images_turned_by_their_phases() -> None:
    expected = (IMAGES * np.array([1, 1j, -1, -1j])[:, None]).sum(axis=0)

    found: Any = phasors.bucket(*IMAGES)
    x, y, most = found

    np.testing.assert_allclose(x + 1j * y, expected)
    np.testing.assert_array_equal(most, IMAGES.max(axis=0))


def test_the_zeroth_moment_is_the_modulus_at_a_low_frequency_and_twice_what_light_adds() -> None:
    low: Any = phasors.low_frequency(X, Y)
    added, most = cast("tuple[Any, Any]", phasors.on_off(X, Y))

    np.testing.assert_allclose(low, np.hypot(X, Y))
    np.testing.assert_allclose(added, 2 * X - 2 * Y)
    np.testing.assert_array_equal(most, np.maximum(X, Y))


def test_a_moment_is_calibrated_by_the_reciprocal_of_its_gain() -> None:
    found: Any = phasors.calibrated(X, Y, U, V)
    re, im = found

    np.testing.assert_allclose(re + 1j * im, (X + 1j * Y) * (U + 1j * V))
