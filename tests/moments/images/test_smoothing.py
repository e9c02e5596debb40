"""Smoothing over pixels."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import transientcam_moments as tm


def image(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(3, 12, 15)) + 1j * rng.normal(size=(3, 12, 15))


@pytest.mark.parametrize("sigma", [0.3, 0.6, 1.5])
def test_inside_it_is_the_gaussian_filter_of_scipy(sigma: float) -> None:
    radius = int(np.ceil(4 * sigma))
    moments = np.pad(image(), ((0, 0), (8, 8), (8, 8)))

    found = tm.smooth(moments, sigma)

    plane = moments[1]
    expected = gaussian_filter(plane.real, sigma, radius=radius) + 1j * gaussian_filter(
        plane.imag, sigma, radius=radius
    )
    inner = (slice(radius, -radius), slice(radius, -radius))
    assert np.allclose(found[1][inner], expected[inner])


def test_a_constant_stays_constant_up_to_the_border() -> None:
    assert np.allclose(tm.smooth(np.full((2, 5, 4), 3 + 1j)), 3 + 1j)


def test_without_width_nothing_changes() -> None:
    moments = image()

    assert np.array_equal(tm.smooth(moments, 0.0), moments)


@pytest.mark.parametrize("bad", [np.nan, np.inf, complex(0, np.nan)])
def test_an_invalid_pixel_counts_as_nothing_for_its_neighbours(bad: complex) -> None:
    moments = image()
    poisoned = moments.copy()
    poisoned[2, 4, 5] = bad  # in one plane only
    hole = np.ones((12, 15), bool)
    hole[4, 5] = False

    found = tm.smooth(poisoned)

    assert np.isfinite(found[:, hole]).all()
    assert not np.isfinite(found[2, 4, 5])
    assert np.array_equal(found[:2, 4, 5], moments[:2, 4, 5])
    # neighbours are the mean over the others, whatever the pixel held before
    moments[:, 4, 5] = 1e6
    moments[2, 4, 5] = np.nan
    assert np.allclose(found[:, hole], tm.smooth(moments)[:, hole])
    far = np.s_[:, :, 10:]
    assert np.array_equal(found[far], tm.smooth(image())[far])


def test_precision_is_kept() -> None:
    for dtype in (np.complex64, np.complex128, np.float32):
        assert tm.smooth(np.ones((2, 3, 3), dtype)).dtype == dtype


def test_wrong_arguments_are_refused() -> None:
    for sigma in (-1.0, 101.0, float("nan")):
        with pytest.raises(tm.ParameterError, match="sigma_px"):
            tm.smooth(image(), sigma)
    with pytest.raises(tm.ShapeError, match="moments"):
        tm.smooth(np.ones(3))
