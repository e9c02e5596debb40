"""Raw images to moments."""

from functools import partial

import numpy as np
import pytest

import transientcam_moments as tm

SHAPE = (3, 5)
measured = partial(tm.measure, zeroth="low-frequency")


def images_of(b: np.ndarray, *, zeroth: str, dark: float = 7.0) -> np.ndarray:
    """What a device with ideal sinusoidal correlation records: dark + (b_0 + Re(b_j e^-it)) / 2."""
    b0 = b[0].real
    images = []
    if zeroth == "low-frequency":
        low = b[0] * np.exp(0.05j)
        images += [dark + (b0 + (low * 1j**-k).real) / 2 for k in range(4)]
    elif zeroth == "on-off":
        images += [dark + b0 / 2, dark + 0 * b0]
    for plane in b[1:]:
        images += [dark + (b0 + (plane * 1j**-k).real) / 2 for k in range(4)]
    return np.stack(images)


def moments(m: int) -> np.ndarray:
    rng = np.random.default_rng(m)
    b = rng.normal(size=(m + 1, *SHAPE)) + 1j * rng.normal(size=(m + 1, *SHAPE))
    b[0] = 5 + np.abs(b[0])
    return b


def test_four_phase_steps_become_a_phasor_without_ambient_light() -> None:
    z = np.array([3 - 4j, 1j])
    steps = np.stack([(z * 1j**-k).real / 2 + 100 for k in range(4)], axis=1)

    assert np.allclose(tm.four_bucket(steps), z)


def test_unsigned_images_do_not_wrap_around() -> None:
    images = np.array([[[0], [65535], [65535], [0]]], dtype=np.uint16)

    phasor = tm.four_bucket(images)

    assert phasor.dtype == np.complex64
    assert phasor[0, 0] == -65535 + 65535j


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
@pytest.mark.parametrize("m", [1, 3, 32])
def test_measure_inverts_the_image_formation(zeroth: str, m: int) -> None:
    b = moments(m)

    found = tm.measure(images_of(b, zeroth=zeroth), zeroth=zeroth)

    expected = b.copy()
    if zeroth == "estimated":
        expected[0] = 0
    assert found.shape == b.shape
    assert np.allclose(found, expected)
    assert np.all(found[0].imag == 0)


def test_the_low_frequency_modulus_does_not_depend_on_the_phase_of_the_electronics() -> None:
    b = moments(2)
    images = images_of(b, zeroth="low-frequency")
    turned = images.copy()
    low = b[0].real * np.exp(2.2j)
    turned[:4] = [7 + (b[0].real + (low * 1j**-k).real) / 2 for k in range(4)]

    assert np.allclose(measured(images)[0], measured(turned)[0])


def test_all_layouts_of_takes_mean_the_same() -> None:
    b = moments(2)
    takes = np.stack([images_of(b, zeroth="low-frequency") + k for k in range(3)])

    flat = measured(takes.reshape(-1, *SHAPE), takes=3)

    assert np.allclose(flat, measured(takes.reshape(3, 3, 4, *SHAPE)))
    assert np.allclose(flat, measured(list(takes.reshape(-1, *SHAPE)), takes=3))
    assert np.allclose(flat, b)


def test_any_trailing_shape_is_kept() -> None:
    b = moments(1)
    images = images_of(b, zeroth="estimated")

    assert tm.measure(images.reshape(4, -1), zeroth="estimated").shape == (2, 15)
    assert tm.measure(images[:, 0, 0], zeroth="estimated").shape == (2,)


def test_a_pixel_with_a_nan_changes_no_other() -> None:
    images = images_of(moments(2), zeroth="low-frequency")
    poisoned = images.copy()
    poisoned[5, 1, 1] = np.nan

    clean, touched = measured(images), measured(poisoned)

    others = np.ones(SHAPE, bool)
    others[1, 1] = False
    assert np.array_equal(clean[:, others], touched[:, others])
    assert np.isnan(touched[1, 1, 1])


def test_saturated_pixels_are_found_in_any_image() -> None:
    images = np.zeros((6, 2, 2), np.uint16)
    images[4, 0, 1] = 4095

    assert tm.saturated(images).tolist() == [[False, True], [False, False]]
    assert not tm.saturated(images, full_scale=65535).any()


@pytest.mark.parametrize("count", [0, 3, 4, 7, 4 * 34])
def test_a_wrong_number_of_images_is_refused(count: int) -> None:
    with pytest.raises(tm.ShapeError, match="images"):
        measured(np.zeros((count, 2, 2)))


def test_wrong_arguments_are_refused_by_name() -> None:
    images = np.zeros((8, 2, 2))
    with pytest.raises(tm.ParameterError, match=r"zeroth = 'dark'.*low-frequency"):
        tm.measure(images, zeroth="dark")
    with pytest.raises(tm.ParameterError, match="takes = 0"):
        measured(images, takes=0)
    with pytest.raises(tm.ShapeError, match="multiple of the 3 takes"):
        measured(images, takes=3)
    with pytest.raises(tm.ShapeError, match=r"\(F, 4, ...\)"):
        tm.four_bucket(np.zeros((2, 3)))
    with pytest.raises(tm.ShapeError, match="takes, F, 4"):
        measured(np.zeros((1, 2, 3, 2, 2)))
