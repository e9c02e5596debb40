"""What pixels of four images become, by complex arithmetic."""

import numpy as np

from transientcam_moments.images import phasors

RANDOM = np.random.default_rng(11)
IMAGES = RANDOM.uniform(0, 4095, (4, 200))
X, Y, U, V = RANDOM.normal(size=(4, 200))


def test_a_phasor_is_the_sum_of_its_images_turned_by_their_phases() -> None:
    expected = (IMAGES * np.array([1, 1j, -1, -1j])[:, None]).sum(axis=0)

    x, y, most = phasors.bucket(*IMAGES)

    np.testing.assert_allclose(x + 1j * y, expected)
    np.testing.assert_array_equal(most, IMAGES.max(axis=0))


def test_the_zeroth_moment_is_the_modulus_at_a_low_frequency_and_twice_what_light_adds() -> None:
    np.testing.assert_allclose(phasors.low_frequency(X, Y), np.hypot(X, Y))
    np.testing.assert_allclose(phasors.on_off(X, Y)[0], 2 * X - 2 * Y)
    np.testing.assert_array_equal(phasors.on_off(X, Y)[1], np.maximum(X, Y))


def test_a_moment_is_calibrated_by_the_reciprocal_of_its_gain() -> None:
    re, im = phasors.calibrated(X, Y, U, V)

    np.testing.assert_allclose(re + 1j * im, (X + 1j * Y) * (U + 1j * V))
