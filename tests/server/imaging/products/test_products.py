"""Values of products against the simulation's ground truth and dense float64 solves."""

import io
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.serving import Served, serving
from transientcam import wire
from transientcam_driver import Sequence, Truth, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_moments.likelihood import MODEL_ERROR
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import PRODUCTS, Crop, Recipe, View
from transientcam_server.imaging._errors_of_range.noise import moment_noise
from transientcam_server.settings import ReconstructionSettings, SensorSettings

LATEST = "/api/v1/frames/latest"
F_HZ = 23e6
LIGHT_M_S = 299_792_458.0
_Array = NDArray[Any]


@pytest.fixture
def still(served: Served, http: httpx.Client) -> httpx.Client:
    """A daemon with one frame, of which all products are."""
    http.get(LATEST, params={"wait_s": 10.0})
    http.put("/api/v1/acquisition", json={"running": False})
    return http


def npy(http: httpx.Client, name: str, **params: Any) -> _Array:
    response = http.get(f"{LATEST}/{name}.npy", params=params)
    assert response.status_code == 200, response.text
    array: _Array = np.load(io.BytesIO(response.content))
    return array


def truth_of(served: Served) -> Truth:
    assert served.camera.simulation is not None
    return served.camera.simulation.truth()


def smoothed(image: _Array) -> _Array:
    """A Gaussian of 0.6 pixels, by its definition."""
    reach = 3
    offsets = np.arange(-reach, reach + 1)
    taps = np.exp(-0.5 * (offsets / 0.6) ** 2)
    total, weight = np.zeros(image.shape, dtype=complex), np.zeros(image.shape)
    padded = np.pad(image.astype(complex), reach, constant_values=np.nan)
    height, width = image.shape
    for dy, wy in zip(offsets, taps, strict=True):
        for dx, wx in zip(offsets, taps, strict=True):
            part = padded[reach + dy : reach + dy + height, reach + dx : reach + dx + width]
            there = np.isfinite(part)
            total[there] += wy * wx * part[there]
            weight[there] += wy * wx
    return total / weight


def toeplitz(b: _Array) -> _Array:
    """The matrix of one pixel's moments, B[j, k] = b_{j-k}."""
    size = len(b)
    return np.array(
        [[b[j - k] if j >= k else b[k - j].conj() for k in range(size)] for j in range(size)]
    )


def test_moments_are_those_of_the_true_returns(served: Served, still: httpx.Client) -> None:
    truth = truth_of(served)
    delay_s, weight = np.nan_to_num(truth.delay_s), truth.weight

    b = npy(still, "moments")

    assert b.shape == (4, 120, 163)
    for j in range(1, 4):
        expected = smoothed((weight * np.exp(2j * np.pi * F_HZ * j * delay_s)).sum(axis=0))
        # quantisation to whole digital numbers is all the noise there is
        assert np.abs(b[j] - expected).max() < 2.5


def test_range_is_that_of_the_first_true_return(served: Served, still: httpx.Client) -> None:
    truth = truth_of(served)

    error_m = np.abs(npy(still, "range") - truth.range_m)

    lit = truth.lit & (truth.brightness > 0.1 * np.median(truth.brightness))
    assert np.median(error_m[lit]) < 0.05


def test_brightness_is_all_the_light_there_is(served: Served, still: httpx.Client) -> None:
    truth = truth_of(served)

    brightness = npy(still, "brightness")

    # the zeroth moment is measured at 0.9 MHz and then raised where the bias needs it
    np.testing.assert_allclose(
        np.median(brightness / smoothed(truth.brightness).real), 1.0, atol=0.02
    )


def test_direct_indirect_and_uniform_add_up_to_brightness(still: httpx.Client) -> None:
    parts = sum(npy(still, name).astype(float) for name in ("direct", "indirect", "uniform"))

    np.testing.assert_allclose(parts, npy(still, "brightness"), rtol=2e-4)


def test_truth_is_the_scenes_own_range(served: Served, still: httpx.Client) -> None:
    truth = truth_of(served)
    np.testing.assert_allclose(npy(still, "truth"), truth.range_m, rtol=1e-6)
    np.testing.assert_allclose(npy(still, "direct_share"), truth.direct_share, atol=1e-6)


def test_coefficients_solve_the_toeplitz_system_of_their_moments(still: httpx.Client) -> None:
    b, planes = npy(still, "moments").astype(complex), npy(still, "coefficients")

    for y, x in ((0, 0), (60, 80), (119, 162), (30, 40), (100, 20)):
        first = np.linalg.solve(toeplitz(b[:, y, x]), np.eye(4)[0])
        error = 1.0 / first[0].real
        polynomial = first * error
        found = planes[1::2, y, x] + 1j * planes[2::2, y, x]
        assert planes[0, y, x] == pytest.approx(error, rel=2e-3)
        np.testing.assert_allclose(found, polynomial[1:], atol=2e-3)


def test_validity_is_the_smallest_eigenvalue_over_brightness(
    served: Served, still: httpx.Client
) -> None:
    truth = truth_of(served)
    delay_s = np.nan_to_num(truth.delay_s)
    expected_b = [
        smoothed((truth.weight * np.exp(2j * np.pi * F_HZ * j * delay_s)).sum(axis=0))
        for j in range(4)
    ]

    validity = npy(still, "validity")

    for y, x in ((60, 80), (30, 40), (100, 20)):
        b = np.array([plane[y, x] for plane in expected_b])
        expected = np.linalg.eigvalsh(toeplitz(b))[0] / b[0].real
        assert validity[y, x] == pytest.approx(expected, abs=6e-3)


def test_biased_pixels_are_flagged_and_fulfil_the_bound(still: httpx.Client) -> None:
    flags, b = npy(still, "flags"), npy(still, "moments").astype(complex)

    assert flags.dtype == np.uint8
    assert set(np.unique(flags)) <= {0, 1}
    for y, x in ((60, 80), (30, 40), (100, 20), (5, 150)):
        eigenvalue = np.linalg.eigvalsh(toeplitz(b[:, y, x]))[0]
        assert eigenvalue / b[0, y, x].real >= 4e-3 * 0.99


def test_a_transient_is_the_density_of_the_coefficients_per_second(still: httpx.Client) -> None:
    planes = npy(still, "coefficients").astype(float)
    times_s = np.array([0.0, 11.3e-9, 19.3e-9, 40e-9])

    density = npy(still, "transient", time_s=list(times_s))

    a = np.concatenate([np.ones((1, 120, 163)), planes[1::2] + 1j * planes[2::2]])
    s = np.exp(2j * np.pi * F_HZ * np.outer(times_s, np.arange(4)))
    denominator = np.abs(np.einsum("tj,jyx->tyx", s, a.conj())) ** 2
    # Eq. (2) per radian, and 2 pi f radians a second
    expected = F_HZ * planes[0] / denominator
    np.testing.assert_allclose(density, expected, rtol=2e-2)


def test_a_cumulative_density_rises_from_nothing_to_all_the_light(still: httpx.Client) -> None:
    period_s = 1.0 / F_HZ
    times_s = [0.0, 0.25 * period_s, 0.5 * period_s, 0.75 * period_s, period_s * (1.0 - 1e-9)]

    cumulative = npy(still, "cumulative", time_s=times_s)

    brightness = npy(still, "brightness")
    assert np.abs(cumulative[0]).max() < 1e-3 * brightness.max()
    assert (np.diff(cumulative, axis=0) >= -1e-3 * brightness.max()).all()
    np.testing.assert_allclose(cumulative[-1], brightness, rtol=5e-3)


def test_raw_images_are_the_measurement_model_of_the_true_returns(
    served: Served, still: httpx.Client
) -> None:
    truth = truth_of(served)
    message = wire.parse_frame(still.get(f"{LATEST}/raw").content)
    sub_phases = served.camera.applied.sequence.sub_phases
    gain = sum(
        w * np.exp(-1j * p) for w, p in zip(sub_phases.weights, sub_phases.phases_rad, strict=True)
    )

    for label, image in zip(message.extra["labels"], message.array, strict=True):
        phase = 2.0 * np.pi * label["frequency_hz"] * np.nan_to_num(truth.delay_s)
        b = (truth.weight * np.exp(1j * phase)).sum(axis=0)
        signal = 0.5 * (truth.brightness + (b * gain * np.exp(-1j * label["phase_rad"])).real)
        # an image is whole digital numbers above a constant dark level
        residual = image.astype(float) - signal
        assert np.ptp(residual) < 3.0


@pytest.mark.parametrize("zeroth", ["on-off", "estimated", "low-frequency"])
@pytest.mark.parametrize("harmonics", [2, 4])
def test_every_way_to_the_zeroth_moment_gives_the_same_range(
    served: Served, http: httpx.Client, zeroth: str, harmonics: int
) -> None:
    document = {"zeroth": zeroth, "harmonics": harmonics, "takes": 1}
    applied = http.put("/api/v1/sequence", json=document).json()
    frame = http.get(LATEST, params={"wait_s": 10.0}).json()
    while frame["sequence_id"] != applied["sequence_id"]:
        frame = http.get(LATEST, params={"wait_s": 10.0, "after": frame["frame"]}).json()

    range_m = npy(http, "range")

    truth = truth_of(served)
    # where there is one return, two harmonics are enough for it
    single = (truth.weight > 0.0).sum(axis=0) == 1
    assert single.sum() > 100 or harmonics == 2
    chosen = single if single.any() else np.ones_like(single)
    tolerance_m = 0.05 if harmonics == 4 or single.any() else 0.5
    assert np.median(np.abs(range_m - truth.range_m)[chosen]) < tolerance_m


def test_saturated_pixels_are_flagged() -> None:
    with (
        serving("sim:mirrors?noise=off") as daemon,
        httpx.Client(base_url=daemon.url, timeout=60.0) as http,
    ):
        http.put("/api/v1/sequence", json={"exposure_s": 0.02})
        frame = http.get(LATEST, params={"wait_s": 10.0}).json()
        while frame["exposure_s"] != 0.02:
            frame = http.get(LATEST, params={"wait_s": 10.0, "after": frame["frame"]}).json()
        http.put("/api/v1/acquisition", json={"running": False})
        raw, flags = npy(http, "raw"), npy(http, "flags")
        meta = http.get(LATEST).json()

    saturated = (raw == 2**daemon.camera.capabilities.bits - 1).any(axis=0)
    assert saturated.any()
    np.testing.assert_array_equal((flags & 4) != 0, saturated)
    assert meta["pixels"]["saturated"] == saturated.sum()


def test_the_deviation_of_the_density_is_that_of_the_moments_noise() -> None:
    with open_camera("sim:mirrors?seed=2", clock=VirtualClock()) as camera:
        applied = camera.configure(Sequence(harmonics=3))
        sensor = sensor_of(camera, SensorSettings())
        camera.start()
        raw = camera.read_frame()
    recipe = Recipe(applied, ReconstructionSettings(), 4095.0, sensor=sensor)
    found, noise = recipe.reconstruct(raw), moment_noise(recipe, recipe.reconstruct(raw))
    view = View((5e-9, 12e-9, 30e-9), Crop((40, 30, 8, 6)))

    std = PRODUCTS["density_std"].compute(recipe, found, view)

    rad_s = 2 * np.pi * recipe.base_frequency_hz
    expected = tm.noise.density_std(
        found.smoothed[:, 30:36, 40:48].astype(complex),
        tm.noise.MomentNoise(noise.variance[:, 30:36, 40:48]),
        rad_s * np.array(view.time_s),
        epsilon=recipe.settings.bias,
    )
    assert np.isfinite(expected).mean() > 0.9
    np.testing.assert_allclose(std, rad_s * expected, rtol=1e-2)


def test_the_registry_is_the_contract() -> None:
    assert set(PRODUCTS) == set(wire.PRODUCTS)
    for name, product in PRODUCTS.items():
        assert product.description is wire.PRODUCTS[name]
        assert product.over_time == ("time" in product.description.axes)
        assert (product.png_steps is not None) == (len(product.description.axes) == 2)


def test_deviation_and_misfit_of_a_frame_are_those_of_its_likelihood() -> None:
    with open_camera("sim:mirrors?seed=2", clock=VirtualClock()) as camera:
        applied = camera.configure(Sequence(harmonics=3))
        sensor = sensor_of(camera, SensorSettings())
        camera.start()
        raw = camera.read_frame()
    # averaged over more pixels, what is left of the noise is far below the model's own error
    settings = ReconstructionSettings(estimator="likelihood", neighbours="gaussian")
    recipe = Recipe(applied, settings, 4095.0, sensor=sensor)
    found = recipe.reconstruct(raw)

    std_m = found.range_std_m
    misfit = PRODUCTS["reduced_chi_square"].compute(recipe, found, View())

    noise = moment_noise(recipe, found)
    expected = tm.likelihood(found.smoothed, noise, model_error=MODEL_ERROR)
    # the noise is smoothed in another order
    close = np.isclose(misfit, expected.reduced_chi_square, rtol=0.02, atol=0.02, equal_nan=True)
    assert close.mean() > 0.999  # where a fit is tried again, may go the other way
    direct = tm.range_m(expected.direct_phase_std_rad(), recipe.base_frequency_hz)
    known = np.isfinite(std_m) & np.isfinite(direct)
    assert known.mean() > 0.9
    assert np.quantile(np.abs(std_m / direct - 1)[known], 0.99) < 0.02
    # of three returns in seven numbers there is one degree of freedom, whose median is 0.45
    assert np.nanmedian(misfit) == pytest.approx(0.45, abs=0.3)
