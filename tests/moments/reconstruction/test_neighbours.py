"""Averaging over neighbours as the settings have it, from raw images on."""

from dataclasses import replace

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.reconstruction.test_detection import SENSOR, captured, halves

SETTINGS = tm.Settings(
    neighbours="edge-preserving",
    estimator="likelihood",
    zeroth="low-frequency",
    takes=1,
    base_frequency_hz=23e6,
    sensor=SENSOR,
)
GAINS = np.ones(5)


def reconstructed(raw: np.ndarray, settings: tm.Settings = SETTINGS) -> tm.Reconstruction:
    return tm.reconstruct(raw, settings, calibration=GAINS)


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
def test_moments_are_averaged_by_the_noise_of_the_sensor(zeroth: str) -> None:
    raw = captured(halves(900.0, 700.0), zeroth)
    settings = replace(SETTINGS, zeroth=zeroth)

    found = reconstructed(raw, settings)

    brightness = found.measured[0].real
    if zeroth == "estimated":
        brightness = abs(found.measured[1:]).max(axis=0)
    noise = tm.noise.moment_noise(brightness, SENSOR, calibration=GAINS, zeroth=zeroth)
    expected = tm.average_neighbours(found.measured, noise)
    assert np.allclose(found.smoothed[1:], expected.moments[1:], rtol=1e-5)
    assert found.variance_share is not None
    assert np.allclose(found.variance_share, expected.share, rtol=1e-4)
    own = replace(settings, neighbours="none")
    left, whole = found.noise, reconstructed(raw, own).noise
    assert left is not None
    assert whole is not None
    ratio = left.variance[1:] / whole.variance[1:]
    assert np.allclose(ratio, expected.share, rtol=0.15)  # the brightness is known better, too
    assert np.median(found.range_std_m) < np.median(reconstructed(raw, own).range_std_m) / 2


def test_without_a_sensor_the_images_tell_the_noise() -> None:
    raw = captured(halves(900.0, 700.0), "low-frequency")

    found = reconstructed(raw, replace(SETTINGS, sensor=None))

    stated = reconstructed(raw)
    assert found.settings.neighbours == "edge-preserving"
    assert isinstance(found.image_noise, tm.noise.ImageNoise)
    assert found.variance_share is not None
    assert stated.variance_share is not None
    assert np.median(found.variance_share) == pytest.approx(
        np.median(stated.variance_share), rel=0.1
    )
    assert np.median(abs(found.smoothed - stated.smoothed)) < 0.5


def test_saturated_pixels_that_are_recovered_are_averaged_like_others() -> None:
    raw = captured(halves(900.0, 900.0), "low-frequency")
    brightest = raw[np.argmax(raw.mean(axis=(1, 2)))]
    settings = replace(SETTINGS, full_scale=float(np.quantile(brightest, 0.2)))
    clipped = np.minimum(raw, settings.full_scale)
    whole = reconstructed(raw, replace(SETTINGS, full_scale=np.inf))

    found = reconstructed(clipped, settings)

    recovered = (np.asarray(found.flags) & tm.Flags.SATURATED > 0) & found.has_range
    assert recovered.mean() > 0.5
    assert whole.variance_share is not None
    assert found.variance_share is not None
    # of twice the noise that images have without a scale
    assert np.median(found.variance_share[recovered]) < 3.5 * np.median(whole.variance_share)


@pytest.mark.parametrize("neighbours", ["none", "gaussian", "edge-preserving"])
def test_recovered_pixels_state_the_noise_of_the_images_that_are_left(neighbours: str) -> None:
    raw = captured(halves(900.0, 900.0), "low-frequency")  # all pixels alike
    settings = replace(SETTINGS, neighbours=neighbours, full_scale=float(np.quantile(raw, 0.7)))
    clear = reconstructed(raw, replace(SETTINGS, full_scale=np.inf))

    found = reconstructed(np.minimum(raw, settings.full_scale), settings)

    recovered = (np.asarray(found.flags) & tm.Flags.SATURATED > 0) & found.has_range
    assert recovered.mean() > 0.2
    assert found.noise is not None
    truth = clear.measured.mean(axis=(1, 2))[1:, None]
    off = found.smoothed[1:, recovered] - truth
    z = np.abs(off) ** 2 / found.noise.variance[1:, recovered] / 2
    # which neighbours agree follows a pixel's own noise
    assert z.mean() == pytest.approx(1.0, abs=0.5 if neighbours == "edge-preserving" else 0.2)


@pytest.mark.parametrize("pixels", ["image", "few"])
def test_where_nothing_tells_the_noise_it_is_the_gaussian(pixels: str) -> None:
    raw = captured(halves(900.0, 700.0), "low-frequency")
    data = tm.measure(raw, zeroth="low-frequency") if pixels == "image" else raw[:, :7, :9]

    found = reconstructed(data, replace(SETTINGS, sensor=None))

    assert found.settings.neighbours == "gaussian"
    assert np.array_equal(found.smoothed, tm.smooth(found.measured))
    assert found.variance_share is None


def test_none_leaves_moments_as_they_are_whatever_the_gaussian() -> None:
    raw = captured(halves(900.0, 700.0), "low-frequency")

    found = reconstructed(raw, replace(SETTINGS, neighbours="none", smoothing_sigma_px=2.0))

    assert np.array_equal(found.smoothed, found.measured)


def test_a_saturated_pixel_is_not_spread() -> None:
    raw = captured(halves(900.0, 700.0), "low-frequency")
    spoilt = raw.copy()
    spoilt[:, 20, 20] = 4095

    found, clean = reconstructed(spoilt), reconstructed(raw)

    near = np.hypot(*(np.mgrid[:48, :64] - 20)) <= 4
    near[20, 20] = False
    moved = abs(found.smoothed - clean.smoothed)[:, near]
    assert moved.max() < 0.02 * abs(clean.smoothed[0]).max()
    assert found.flags[20, 20] & tm.Flags.SATURATED


def test_pixels_without_light_have_no_range() -> None:
    found = reconstructed(captured(halves(0.0, 400.0), "low-frequency"))

    assert np.isfinite(found.range_m[:, :28]).mean() < 0.03
    assert np.isfinite(found.range_m[:, 36:]).mean() > 0.99


def test_another_way_is_refused() -> None:
    with pytest.raises(tm.ParameterError, match="neighbours"):
        tm.Settings(neighbours="bilateral")
