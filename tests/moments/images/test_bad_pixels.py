"""Hot, stuck, noisy and dead pixels, and what is put in their place."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

import transientcam_moments as tm

_Array = NDArray[Any]
SHAPE = (9, 11)


def dark(seed: int = 0) -> _Array:
    """Dark levels of a good sensor: a little different from pixel to pixel."""
    return 64 + np.random.default_rng(seed).normal(0, 2, SHAPE)


def naive_fill(image: _Array, bad: _Array) -> _Array:
    """Fill from the rim inwards, pixel by pixel."""
    out, left = image.astype(float).copy(), bad.copy()
    while left.any():
        done = []
        for y, x in np.argwhere(left):
            good = [
                out[v, u]
                for v in range(max(0, y - 1), min(SHAPE[0], y + 2))
                for u in range(max(0, x - 1), min(SHAPE[1], x + 2))
                if not left[v, u]
            ]
            if good:
                done.append((y, x, np.mean(good)))
        for y, x, value in done:
            out[y, x], left[y, x] = value, False
    return out


def test_a_good_sensor_has_no_bad_pixel() -> None:
    for seed in range(20):
        assert not tm.find_bad_pixels(dark=dark(seed)).any()
    assert not tm.find_bad_pixels(dark=np.full(SHAPE, 64.0)).any()


@pytest.mark.parametrize("level", [0.0, 4095.0, 300.0, np.nan])
def test_hot_and_stuck_pixels_stand_out_in_the_dark(level: float) -> None:
    image = dark()
    image[3, 7] = level

    bad = tm.find_bad_pixels(dark=image)

    assert np.argwhere(bad).tolist() == [[3, 7]]


def test_noisy_pixels_stand_out_by_their_deviation_and_quiet_ones_do_not() -> None:
    deviation = 3 + np.random.default_rng(1).normal(0, 0.2, SHAPE)
    deviation[1, 2], deviation[5, 5] = 40.0, 0.0

    bad = tm.find_bad_pixels(dark=dark(), dark_deviation=deviation)

    assert np.argwhere(bad).tolist() == [[1, 2]]


def test_dead_pixels_stand_out_in_the_light() -> None:
    brightness = np.linspace(500, 1000, 99).reshape(SHAPE)  # brighter on one side
    brightness[8, 0] = 5.0

    assert np.argwhere(tm.find_bad_pixels(brightness=brightness)).tolist() == [[8, 0]]


def test_images_of_different_shapes_are_refused() -> None:
    with pytest.raises(tm.ShapeError, match="of the same shape"):
        tm.find_bad_pixels(dark=dark(), brightness=np.ones((3, 3)))
    with pytest.raises(tm.ShapeError, match="none"):
        tm.find_bad_pixels()


@given(bad=st.lists(st.booleans(), min_size=99, max_size=99))
def test_filling_is_the_mean_of_good_neighbours_from_the_rim_inwards(bad: list[bool]) -> None:
    mask = np.array(bad).reshape(SHAPE)
    image = np.random.default_rng(3).integers(0, 4096, SHAPE).astype(float)
    if mask.all():
        return

    filled = tm.fill_bad_pixels(image[None], mask)[0]

    np.testing.assert_allclose(filled, naive_fill(image, mask), rtol=1e-12)
    assert np.array_equal(filled[~mask], image[~mask])


def test_what_a_bad_pixel_showed_has_no_influence() -> None:
    images = np.random.default_rng(3).integers(0, 4096, (4, *SHAPE)).astype(np.uint16)
    mask = np.zeros(SHAPE, dtype=bool)
    mask[4, 4:6] = True
    other = np.where(mask, np.uint16(65535), images)

    assert np.array_equal(tm.fill_bad_pixels(images, mask), tm.fill_bad_pixels(other, mask))
    assert tm.fill_bad_pixels(images, mask).dtype == np.float32


def test_nothing_to_replace_leaves_the_images_themselves() -> None:
    images = np.ones((2, *SHAPE), np.uint16)

    assert tm.fill_bad_pixels(images, np.zeros(SHAPE, dtype=bool)) is images
    assert tm.fill_bad_pixels(images, np.ones(SHAPE, dtype=bool)) is images


def test_a_mask_that_does_not_fit_is_refused() -> None:
    for mask in (np.zeros((3, 3), dtype=bool), np.zeros(SHAPE)):
        with pytest.raises(tm.ShapeError, match="bad"):
            tm.fill_bad_pixels(np.ones(SHAPE), mask)


def images_of(delay_rad: float, takes: int = 1) -> _Array:
    """Raw images (takes * 8, H, W) of one return, measured with on and off, m = 1."""
    phases = np.arange(4) * np.pi / 2
    levels = [64 + 400, 64, *(64 + 400 * (1 + np.cos(delay_rad - phases)))]
    return np.tile(np.array(levels)[:, None, None] * np.ones((1, *SHAPE)), (takes, 1, 1))


def test_a_reconstruction_replaces_and_flags_bad_pixels() -> None:
    images = images_of(2.0).astype(np.uint16)
    images[:, 2, 3] = 4095  # stuck at the end of its scale
    mask = np.zeros(SHAPE, dtype=bool)
    mask[2, 3] = True
    settings = tm.Settings(23e6, "on-off", takes=1, smoothing_sigma_px=0.0)

    found = tm.reconstruct(images, settings, calibration=np.ones(2), bad_pixels=mask)
    untouched = tm.reconstruct(images, settings, calibration=np.ones(2))

    assert found.flags[2, 3] & tm.Flags.REPLACED
    assert not found.flags[2, 3] & tm.Flags.SATURATED
    assert not (found.flags[~mask] & tm.Flags.REPLACED).any()
    assert found.phase_rad[2, 3] == pytest.approx(2.0, abs=2e-3)
    np.testing.assert_array_equal(found.moments[:, ~mask], untouched.moments[:, ~mask])


def test_a_reconstruction_states_how_many_images_it_left_out() -> None:
    noise = np.random.default_rng(0).normal(0, 1, (60, *SHAPE))
    images = images_of(2.0, takes=10) + noise
    images[13] *= 0.7  # two takes, one image each
    images[44] *= 1.2
    ten, one = (tm.Settings(23e6, "on-off", takes) for takes in (10, 1))

    assert tm.reconstruct(images, ten, calibration=np.ones(2)).rejected_images == 2
    assert tm.reconstruct(images[:6], one, calibration=np.ones(2)).rejected_images == 0
