"""Light that is not the camera's, in images of known light, and its noise in drawn ones."""

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_moments import noise

SENSOR = noise.Sensor(gain_e_per_dn=9.0, read_noise_e=30.0, dark_dn=64.0)
SHAPE = (24, 31)
PHASES_RAD = np.arange(4) * np.pi / 2
_Array = NDArray[np.float64]


def expected_images(
    b: NDArray[np.complex128], ambient_dn: _Array, zeroth: str = "low-frequency"
) -> _Array:
    """Return the means (N, H, W) of the images of moments (m + 1, H, W), Sec. 3.1."""
    low = [np.asarray(b[0]).real + 0j] * (zeroth == "low-frequency")
    images = [
        (b[0].real + (phasor * np.exp(-1j * phase)).real) / 2
        for phasor in (*low, *b[1:])
        for phase in PHASES_RAD
    ]
    if zeroth == "on-off":
        images = [b[0].real / 2, 0 * b[0].real, *images]
    return np.stack(images) + SENSOR.dark_dn + ambient_dn


def one_return(m: int = 3, light_dn: float = 400.0) -> NDArray[np.complex128]:
    phase_rad = np.linspace(0.5, 4.0, SHAPE[0] * SHAPE[1]).reshape(SHAPE)
    b: NDArray[np.complex128] = light_dn * np.exp(1j * np.arange(m + 1)[:, None, None] * phase_rad)
    return b


def patch_dn(light_dn: float = 300.0) -> _Array:
    """Return sun on a part of the picture."""
    ambient = np.zeros(SHAPE)
    ambient[5:15, 8:20] = light_dn
    return ambient


def drawn(images: _Array, seed: int) -> _Array:
    random = np.random.default_rng(seed)
    std = np.sqrt(SENSOR.image_variance(images - SENSOR.dark_dn))
    return random.normal(images, std)


def settings(zeroth: str, sigma_px: float = 0.0) -> tm.Settings:
    return tm.Settings(
        zeroth=zeroth,
        takes=1,
        base_frequency_hz=23e6,
        smoothing_sigma_px=sigma_px,
        neighbours="gaussian",
        sensor=SENSOR,
    )


def test_a_patch_of_sun_is_found_where_it_is() -> None:
    b, ambient = one_return(), patch_dn()
    images = expected_images(b, ambient)[:4]

    found = noise.ambient_light(images, b[0].real, SENSOR)

    assert found is not None
    np.testing.assert_allclose(found, ambient, atol=1e-9)


def test_without_other_light_there_is_none_whatever_the_noise() -> None:
    b = one_return(light_dn=30.0)
    for seed in range(20):
        images = drawn(expected_images(b, np.zeros(SHAPE)), seed)[:4]
        assert noise.ambient_light(images, b[0].real, SENSOR) is None


def test_edges_of_what_is_smoothed_are_no_other_light() -> None:
    b = one_return()
    b[:, :, 10:] *= 0.1
    images = expected_images(b, np.zeros(SHAPE))[:4]
    smoothed = tm.smooth(b, 1.5)[0].real

    assert noise.ambient_light(images, smoothed, SENSOR, sigma_px=1.5) is None


def test_light_that_hardly_adds_noise_is_left_out() -> None:
    b = one_return(light_dn=2000.0)
    images = expected_images(b, np.full(SHAPE, 50.0))[:4]  # 1000 DN have 111 DN^2, these 5.6

    assert noise.ambient_light(images, b[0].real, SENSOR) is None


def test_bad_pixels_say_nothing() -> None:
    b, bad = one_return(), np.zeros(SHAPE, dtype=bool)
    bad[3, 4] = True
    images = expected_images(b, patch_dn())[:4]
    images[:, 3, 4] = 4095.0

    found = noise.ambient_light(images, b[0].real, SENSOR, sigma_px=0.6, bad_pixels=bad)

    assert found is not None
    assert found[3, 4] == 0.0
    assert found[2:5, 3:6].max() < 0.01


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
@pytest.mark.parametrize("sigma_px", [0.0, 0.6])
def test_noise_in_the_sun_is_what_moments_of_drawn_images_show(
    zeroth: str, sigma_px: float
) -> None:
    b, ambient = one_return(), patch_dn()
    images = expected_images(b, ambient, zeroth)
    gains = tm.nominal_calibration(3, zeroth=zeroth)
    reconstructor = tm.Reconstructor(settings(zeroth, sigma_px), calibration=gains)
    captures = [reconstructor(drawn(images, seed)) for seed in range(60)]
    noises = [each.noise for each in captures if each.noise is not None]
    first = 1 if zeroth == "estimated" else 0
    planes = np.stack([np.asarray(each.smoothed) for each in captures])[:, first:]
    measured = planes.real.var(axis=0, ddof=1)

    assert len(noises) == len(captures)
    stated = np.mean([np.asarray(each.variance) for each in noises], axis=0)[first:]

    inside, outside = np.s_[:, 7:13, 10:18], np.s_[:, 18:, 22:]
    for where in (inside, outside):
        ratio = measured[where].mean(axis=(1, 2)) / stated[where].mean(axis=(1, 2))
        np.testing.assert_allclose(ratio, 1.0, rtol=0.12)
    assert stated[inside].mean() > 1.5 * stated[outside].mean()


def test_takes_of_uneven_phases_say_nothing() -> None:
    phases_rad = (0.0, 1.0, 2.5)
    images = np.full((6, *SHAPE), 900.0)
    chosen = tm.Settings(
        zeroth="estimated", takes=1, base_frequency_hz=23e6, sensor=SENSOR, phases_rad=phases_rad
    )
    found = tm.Reconstructor(chosen, calibration=np.ones(3))(images)

    assert found.ambient is None


def test_moments_of_another_reconstruction_bring_their_light_along() -> None:
    b = one_return().astype(np.complex64)
    reconstructor = tm.Reconstructor(settings("low-frequency"), calibration=np.ones(4))

    dim = reconstructor(tm.Measured(b)).noise
    bright = reconstructor(tm.Measured(b, ambient_dn=100.0)).noise

    assert dim is not None
    assert bright is not None
    more = bright.variance - dim.variance
    # 2 images of 100 DN more in each part of a phasor of four
    np.testing.assert_allclose(more, 2 * 100.0 / SENSOR.gain_e_per_dn, rtol=1e-4)
