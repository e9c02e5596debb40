"""Contradictory pixels are those whose moments disagree by more than noise explains."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Sequence, open_camera
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import Recipe, contradictory_share
from transientcam_server.imaging._errors_of_range import noise as module
from transientcam_server.imaging._errors_of_range.noise import (
    beyond_noise,
    contradictions,
    moment_noise,
    range_noise,
)
from transientcam_server.settings import ReconstructionSettings, SensorSettings

SHAPE = (40, 50)
STD_DN = 2.0


def moments(phase_error_rad: tuple[float, ...], *, seed: int = 1) -> NDArray[np.complex64]:
    """Moments of one return a pixel, with noise, and an error of each harmonic's phase."""
    random = np.random.default_rng(seed)
    phase_rad = random.uniform(0.5, 5.5, SHAPE)
    exact = [
        800.0 * np.exp(1j * (j * phase_rad + error)) for j, error in enumerate(phase_error_rad)
    ]
    noise = random.normal(0.0, STD_DN, (2, len(exact), *SHAPE))
    b = np.stack(exact) + noise[0] + 1j * noise[1]
    b[0] = b[0].real
    return np.asarray(b, dtype=np.complex64)


def share(b: NDArray[np.complex64]) -> float | None:
    found = tm.reconstruct(b, tm.Settings(smoothing_sigma_px=0.0))
    lit = (found.flags & tm.Flags.NO_SIGNAL) == 0

    def noise_of(light: NDArray[np.float32]) -> tm.noise.MomentNoise:
        return tm.noise.MomentNoise(np.full((len(b), *light.shape), 2 * STD_DN**2))

    beyond = beyond_noise(found, noise_of)
    assert not beyond[~lit].any()
    return float(beyond[lit].mean()) if lit.any() else None


def test_noise_alone_makes_hardly_any_pixel_contradictory() -> None:
    assert share(moments((0.0, 0.0, 0.0, 0.0))) == pytest.approx(0.0, abs=0.005)


def test_a_phase_that_all_harmonics_share_alike_is_a_delay_and_no_contradiction() -> None:
    assert share(moments((0.0, 0.1, 0.2, 0.3))) == pytest.approx(0.0, abs=0.005)


def test_a_harmonic_whose_phase_has_drifted_makes_nearly_all_contradictory() -> None:
    """arg b_2 = 2 arg b_1 for one return: 0.1 rad off cannot be the moments of any light."""
    few = share(moments((0.0, 0.0, 0.01, 0.0)))
    most = share(moments((0.0, 0.0, 0.1, 0.0)))

    assert few is not None
    assert most is not None
    assert few < 0.1
    assert most > 0.9


def test_more_light_than_there_is_is_a_contradiction() -> None:
    b = moments((0.0, 0.0, 0.0, 0.0))
    b[2] *= 1.1  # |b_2| <= b_0

    contradictory = share(b)

    assert contradictory is not None
    assert contradictory > 0.9


def test_pixels_without_light_are_not_counted() -> None:
    b = moments((0.0, 0.0, 0.0, 0.0))
    b[:, :20] = 0.0

    assert share(b) == pytest.approx(0.0, abs=0.005)
    assert share(np.zeros_like(b)) is None


@pytest.mark.parametrize("corrupt", [(8, 12), (30, 50)], ids=["few", "many"])
@pytest.mark.parametrize("smoothing_px", [0.0, 0.6])
def test_pixels_settled_without_their_neighbours_are_those_of_the_smoothed_noise(
    smoothing_px: float, corrupt: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_BLOCK_PIXELS", 300)  # of which there are several, the last short
    b = moments((0.0, 0.0, 0.0, 0.0))
    b *= np.random.default_rng(2).uniform(0.05, 1.0, SHAPE).astype(np.float32)
    rows, columns = corrupt
    b[2, :rows, :columns] *= np.linspace(1.0, 1.6, columns, dtype=np.float32)
    b[:, 3, 4] = np.nan
    found = tm.reconstruct(b, tm.Settings(smoothing_sigma_px=smoothing_px))
    brightness = found.smoothed[0].real

    def noise_of(light: NDArray[np.float32]) -> tm.noise.MomentNoise:
        return tm.noise.MomentNoise(np.stack([1.0 + 0.01 * light] * len(b)))

    beyond = beyond_noise(found, noise_of)

    of_pixels = noise_of(np.maximum(brightness, 0))
    std = np.sqrt(tm.noise.smoothed(of_pixels, smoothing_px).variance.sum(axis=0))
    expected = (found.validity * brightness < -4 * std) & found.has_range
    assert 0 < expected.sum() < expected.size
    np.testing.assert_array_equal(beyond, expected)


Zeroth = Literal["low-frequency", "on-off", "estimated"]


def recipe(zeroth: Zeroth) -> Recipe:
    with open_camera("sim:wall") as camera:
        applied = camera.validate(Sequence(harmonics=3, zeroth=zeroth))
        sensor = sensor_of(camera, SensorSettings())
    unsmoothed = ReconstructionSettings(neighbours="none")
    return Recipe(applied, unsmoothed, 65535.0, sensor=sensor)


def reconstruction(b: NDArray[np.complex64], zeroth: str) -> tm.Reconstruction:
    return tm.reconstruct(b, tm.Settings(smoothing_sigma_px=0.0, zeroth=zeroth))


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
def test_the_noise_of_moments_is_that_of_the_sensor_at_their_brightness(zeroth: Zeroth) -> None:
    used = recipe(zeroth)
    found = reconstruction(moments((0.0, 0.0, 0.0, 0.0)), "low-frequency")
    found.smoothed[0] = np.linspace(-5, 4000, found.smoothed[0].size).reshape(SHAPE)
    assert used.sensor is not None

    variance = moment_noise(used, found).variance

    expected = tm.noise.moment_noise(
        found.smoothed[0].real, used.sensor, calibration=used.nominal_gains, zeroth=zeroth
    ).variance
    assert variance.dtype == np.float32
    np.testing.assert_allclose(variance, expected, rtol=1e-6)


def test_contradictions_are_distinguished_from_what_noise_biased() -> None:
    """The exact moments of one return have no uniform part: biased, and right."""
    b = moments((0.0, 0.0, 0.0, 0.0))
    b[2, :20] *= 1.5

    found = reconstruction(b, "low-frequency")
    contradictory = contradictions(recipe("low-frequency"), found)

    assert (found.flags & tm.Flags.BIASED > 0).mean() > 0.9
    assert contradictory is not None
    assert contradictory[:20].all()
    assert not contradictory[20:].any()
    found.add_flag(tm.Flags.CONTRADICTORY, contradictory)
    assert (found.flags[:20] & tm.Flags.CONTRADICTORY > 0).all()
    assert found.flags.dtype == np.uint8
    assert found.has_range.all()


def test_an_estimated_zeroth_moment_hides_contradictions_and_says_so() -> None:
    b = moments((0.0, 0.0, 0.1, 0.0))

    found = reconstruction(b, "estimated")

    assert contradictions(recipe("estimated"), found) is None
    assert contradictory_share(recipe("estimated"), found) is None


def test_the_predicted_deviation_is_the_noise_of_the_likelihood_where_it_is_the_estimator() -> None:
    likely = replace(
        recipe("low-frequency"), settings=ReconstructionSettings(estimator="likelihood")
    )
    settings = likely.settings.for_moments(
        base_frequency_hz=likely.base_frequency_hz,
        zeroth="low-frequency",
        takes=1,
        sensor=likely.sensor,
    )
    found = tm.Reconstruction(moments((0.0, 0.0, 0.0, 0.0)), settings)

    predicted = range_noise(likely, found)

    assert predicted is not None
    assert predicted["median"] == pytest.approx(float(np.nanmedian(found.range_scatter_m())))
    assert predicted["median"] < float(np.nanmedian(found.range_std_m))
    assert predicted["p90"] >= predicted["median"]
    assert predicted["first_order_share"] == found.likelihood.explained().mean()
    dark = tm.Reconstruction(np.zeros((4, *SHAPE), np.complex64), settings)
    assert range_noise(likely, dark) is None
