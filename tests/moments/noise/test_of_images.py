"""The noise of images from the images: against the sensor that drew them, whatever is before it."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm

SHAPE = (60, 80)
M = 4


def drawn(
    sensor: tm.noise.Sensor,
    *,
    phases: int = 4,
    takes: int = 1,
    second_harmonic: float = 0.0,
    ambient: float = 0.0,
    taps: int = 1,
    moving: float = 0.0,
    seed: int = 0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return images (takes, M * phases, ...) and b_0: a ramp of light and of range, in stripes."""
    random = np.random.default_rng(seed)
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    light = 300.0 + 15.0 * column + 300.0 * (row // 10 % 2)
    images: list[NDArray[np.float64]] = []
    for _ in range(takes):
        for j in range(1, M + 1):
            for theta in 2 * np.pi * np.arange(phases) / phases:
                wave = j * (1.0 + 0.01 * row)
                signal = light / 2 * (1 + 0.8 * np.cos(wave - theta))
                signal = signal + light / 2 * second_harmonic * np.cos(2 * (wave - theta)) + ambient
                signal = signal * (1 + moving * len(images) * ((column >= 30) & (column < 38)))
                if taps == 2:
                    other = light - signal
                    electrons = random.poisson(signal * sensor.gain_e_per_dn) - random.poisson(
                        other * sensor.gain_e_per_dn
                    )
                else:
                    electrons = random.poisson(signal * sensor.gain_e_per_dn)
                read = random.normal(0, sensor.read_noise_e, SHAPE)
                images.append((electrons + read) / sensor.gain_e_per_dn + sensor.dark_dn)
    stack = np.rint(np.array(images)).reshape((takes, -1, *SHAPE))
    return stack, light.astype(float)


def measured(
    images: NDArray[np.float64], light: NDArray[np.float64], phases: int = 4, **options: Any
) -> tm.noise.ImageNoise | None:
    phases_rad = tuple(2 * np.pi * k / phases for k in range(phases))
    return tm.noise.image_noise(tm.noise.CapturedImages(images, phases_rad, **options), light)


def ratio(
    found: tm.noise.ImageNoise | None, sensor: tm.noise.Sensor, light: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the deviation found over that of the sensor, of images without other light."""
    assert found is not None
    level = sensor.dark_dn + light / 2
    true = sensor.image_variance(light / 2)
    ratios: NDArray[np.float64] = np.sqrt(found.image_variance(level - found.dark_dn) / true)
    return ratios


@pytest.mark.parametrize(
    "sensor",
    [
        tm.noise.Sensor(),
        tm.noise.Sensor(gain_e_per_dn=0.5, read_noise_e=1.0, bits=16),
        tm.noise.Sensor(gain_e_per_dn=20.0, read_noise_e=100.0),
        tm.noise.Sensor(gain_e_per_dn=1000.0, read_noise_e=700.0),
    ],
    ids=["usual", "shot", "read", "rounded"],
)
@pytest.mark.parametrize(("phases", "takes"), [(4, 1), (4, 3), (3, 1), (3, 2), (5, 1)])
def test_the_deviation_is_that_of_the_sensor(
    sensor: tm.noise.Sensor, phases: int, takes: int
) -> None:
    images, light = drawn(sensor, phases=phases, takes=takes)

    found = measured(images, light, phases)

    assert np.abs(ratio(found, sensor, light) - 1).max() < 0.05


@pytest.mark.parametrize("takes", [1, 2])
def test_even_harmonics_and_motion_are_no_noise(takes: int) -> None:
    sensor = tm.noise.Sensor()
    uneven, light = drawn(sensor, takes=takes, second_harmonic=0.05)
    moving, _ = drawn(sensor, takes=takes, moving=0.05)

    for images, most in ((uneven, 0.05), (moving, 0.2)):
        found = measured(images, light)
        assert np.abs(ratio(found, sensor, light) - 1).max() < most


def test_saturated_and_bad_pixels_and_changed_images_are_left_out() -> None:
    sensor = tm.noise.Sensor()
    images, light = drawn(sensor)
    images[:, 4:8] = 100 * np.random.default_rng(1).random((4, *SHAPE))  # one frequency
    images[:, :, :30] += np.random.default_rng(2).normal(0, 500, (1, 16, 30, SHAPE[1]))
    left_out = np.zeros((1, 16), dtype=bool)
    left_out[0, 5] = True
    mask = np.zeros(SHAPE, dtype=bool)
    mask[:29] = True  # and the row beside is not used either

    found = measured(images, light, left_out=left_out, saturated_pixels=mask)

    assert np.abs(ratio(found, sensor, light) - 1).max() < 0.05


def test_differences_of_two_taps_have_the_noise_of_the_light_of_both() -> None:
    sensor = tm.noise.Sensor(dark_dn=2000.0)
    images, light = drawn(sensor, taps=2)

    found = measured(images, light)

    assert found is not None
    true = sensor.image_variance(light)
    assert np.abs(np.sqrt(found.image_variance(light / 2) / true) - 1).max() < 0.05


@pytest.mark.parametrize("unit", [1e-3, 1.0])
def test_the_noise_of_real_numbers_is_free_of_their_unit(unit: float) -> None:
    images, light = drawn(tm.noise.Sensor())
    images = images + np.random.default_rng(3).random(images.shape)
    at = np.array([100.0, 500.0])

    one = measured(images, light)
    other = measured(unit * images, unit * light)

    assert one is not None
    assert other is not None
    np.testing.assert_allclose(
        other.image_variance(unit * at), unit**2 * one.image_variance(at), rtol=1e-6
    )


@pytest.mark.parametrize("shape", [(1, 3, 9, 8), (1, 3, 8, 8), (1, 16, 2, 2), (1, 16, 9, 8)])
def test_a_capture_that_does_not_tell_has_no_noise(shape: tuple[int, ...]) -> None:
    light = np.zeros(shape[2:]) if shape[2] == 9 else np.ones(shape[2:])

    assert measured(np.ones(shape), light, 3 if shape[1] == 3 else 4) is None


def test_a_reconstruction_measures_the_noise_and_holds_a_stated_sensor_against_it() -> None:
    true = tm.noise.Sensor()
    images, light = drawn(true, ambient=40.0)
    stated = tm.noise.Sensor(gain_e_per_dn=2.25, read_noise_e=7.5)
    settings = tm.Settings(23e6, "estimated", 1)

    def found(sensor: tm.noise.Sensor | None) -> tm.Reconstruction:
        given = tm.Settings(23e6, "estimated", 1, estimator="unwrapped-phase", sensor=sensor)
        return tm.reconstruct(images[0].astype(np.uint16), given, calibration=np.ones(M + 1))

    assert settings.technique == "likelihood"
    own, known, wrong = found(None), found(true), found(stated)
    assert own.noise is not None
    assert known.noise is not None
    ratios = np.sqrt(own.noise.variance[1:] / known.noise.variance[1:])
    assert abs(np.median(ratios) - 1) < 0.05
    assert known.noise_ratio == pytest.approx(1, abs=0.05)
    assert wrong.noise_ratio == pytest.approx(0.5, abs=0.05)
    assert own.noise_ratio is None
    assert isinstance(own.image_noise, tm.noise.ImageNoise)
    as_sensor = own.image_noise.as_sensor(4095)
    np.testing.assert_allclose(
        as_sensor.image_variance(light) / own.image_noise.image_variance(light), 1, rtol=0.01
    )
