"""The workspace of compiled stages against the stages one by one."""

import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.kernel_lanes import lanes, without_lanes

M = 3
SHAPE = (37, 53)
Array = NDArray[Any]


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with lanes(M, precisions=("float32",)):
        yield


def raw_images(settings: tm.Settings, *, shape: tuple[int, int] = SHAPE, seed: int = 0) -> Array:
    """Three returns a pixel that vary over the image, with noise, and some special pixels."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: shape[0], : shape[1]] / max(shape)
    phase_rad = np.stack([1 + 1.5 * x + 0.5 * y, 2.5 + x * y, 4 + x])
    weight = np.stack([800 + 600 * np.sin(6 * x), 300 + 300 * y, 150 + 0 * x])
    b = np.stack([(weight * np.exp(1j * j * phase_rad)).sum(0) for j in range(M + 1)])
    step = np.exp(-0.5j * np.pi * np.arange(4))[:, None, None]
    first = {
        "low-frequency": [50 + (b[0].real + np.real(b[0] * step)) / 2],
        "on-off": [np.stack([50 + b[0].real / 2, 50 + 0 * b[0].real])],
        "estimated": [],
    }[settings.zeroth]
    images = np.concatenate([*first, *(50 + (b[0].real + np.real(c * step)) / 2 for c in b[1:])])
    images = rng.poisson(images) + rng.normal(0, 2, images.shape)
    images[:, 3, 5] = 0  # a dead pixel
    images[2, 7, 7] = 4095  # a saturated one
    images[:, 20:24, 30:40] = 50  # darkness
    images[6, 30, 30] = 3000  # contradictory data
    return np.clip(np.round(images), 0, 4095).astype(np.uint16)


def gains(kind: str, shape: tuple[int, int] = SHAPE) -> Array | None:
    rng = np.random.default_rng(1)
    if kind == "none":
        return None
    gain = 1 + 0.1 * (rng.normal(size=M + 1) + 1j * rng.normal(size=M + 1))
    gain[0] = gain[0].real
    if kind == "frequencies":
        return gain
    gain = gain[:, None, None] * (1 + 0.01 * rng.normal(size=(M + 1, *shape)))
    gain[1, 20, 20], gain[2, 21, 40] = 0, np.nan  # dead pixels of the calibration
    return gain


SETTINGS = [
    tm.Settings(),
    tm.Settings(smoothing_sigma_px=0.0),
    tm.Settings(smoothing_sigma_px=1.3, epsilon=0.05),
    tm.Settings(zeroth="on-off", minimum_brightness=500.0),
    tm.Settings(zeroth="estimated"),
    tm.Settings(threshold=0.6, base_frequency_hz=11e6, full_scale=900.0),
]


@pytest.mark.parametrize("calibration", ["none", "frequencies", "pixels"])
@pytest.mark.parametrize("settings", SETTINGS, ids=range(len(SETTINGS)))
def test_a_workspace_gives_what_the_stages_give(settings: tm.Settings, calibration: str) -> None:
    images, gain = raw_images(settings), gains(calibration)
    workspace = tm.kernels.reconstructor(SHAPE, M, settings, gain)
    assert workspace is not None

    found = workspace(images)

    with without_lanes():
        expected = tm.reconstruct(images, settings, calibration=gain)
        stages = {
            "validity": (expected.validity, 1.0),
            "uniform": (expected.uniform, 1.0),
            "brightness": (expected.brightness, None),
            "error": (expected.coefficients.error, None),
            "direct": (expected.direct, None),
            "indirect": (expected.indirect, None),
            "range_m": (expected.range_m, 1.0),
        }
        flags, count = expected.flags, expected.returns.count
        coefficients = expected.coefficients
        brightness = float(np.nanmax(expected.brightness))
    assert np.array_equal(found.flags, flags)
    assert np.array_equal(found.count, count)
    finite = (flags & int(tm.Flags.NON_FINITE)) == 0
    for name, (stage, scale) in stages.items():
        value = getattr(found, name)
        assert value.dtype == np.float32
        assert np.array_equal(np.isnan(value[finite]), np.isnan(stage[finite])), name
        error = np.abs(value[finite] - stage[finite]) / (scale or brightness)
        # what conditions as bad as a weak uniform part make of rounding
        assert np.nanmax(error) < 2e-3, name
        assert np.nanmedian(error) < 2e-6 * (brightness if scale else 1), name
    lit = finite & (found.brightness > 0)
    assert np.abs(found.polynomial - coefficients.polynomial)[:, lit].max() < 1e-3
    assert np.abs(found.reflection - coefficients.reflection)[:, lit].max() < 1e-3


def test_light_is_complete() -> None:
    settings = tm.Settings()
    workspace = tm.kernels.reconstructor(SHAPE, M, settings)
    assert workspace is not None

    found = workspace(raw_images(settings))

    total = found.direct + found.indirect + found.uniform
    assert np.allclose(total, found.brightness, rtol=1e-4, atol=1e-2)
    assert np.allclose(found.weight.sum(axis=0), found.direct + found.indirect, rtol=1e-5)


def test_a_density_can_be_evaluated_from_the_workspace() -> None:
    settings = tm.Settings()
    workspace = tm.kernels.reconstructor(SHAPE, M, settings)
    assert workspace is not None
    images = raw_images(settings)

    found = workspace(images)
    density = tm.density(
        tm.Coefficients(found.error, found.polynomial, found.reflection), np.linspace(0, 6, 7)
    )

    with without_lanes():
        expected = tm.density(tm.reconstruct(images, settings).coefficients, np.linspace(0, 6, 7))
    assert np.allclose(density, expected, rtol=1e-2, atol=1e-3)


@pytest.mark.parametrize("parts", [2, 3])
def test_threads_change_nothing(parts: int) -> None:
    settings = tm.Settings()
    images = raw_images(settings, shape=(120, 163))
    workspace = tm.kernels.reconstructor((120, 163), M, settings)
    assert workspace is not None
    alone = [part.copy() for part in workspace(images)]

    with ThreadPoolExecutor(2) as executor:
        together = workspace(images, spread=tm.kernels.over(executor, parts))

    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one, other, equal_nan=True)


def test_every_frame_starts_afresh() -> None:
    """Nothing of a frame may be left in the next one's result."""
    settings = tm.Settings()
    workspace = tm.kernels.reconstructor(SHAPE, M, settings)
    assert workspace is not None
    first = [part.copy() for part in workspace(raw_images(settings))]

    workspace(raw_images(settings, seed=5) // 3)

    for one, again in zip(first, workspace(raw_images(settings)), strict=True):
        assert np.array_equal(one, again, equal_nan=True)


def test_a_frame_allocates_no_images() -> None:
    settings = tm.Settings()
    images = raw_images(settings, shape=(120, 163))
    workspace = tm.kernels.reconstructor((120, 163), M, settings)
    assert workspace is not None
    for _ in range(3):
        workspace(images)

    tracemalloc.start()
    workspace(images)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    assert workspace.redone > 0, "the case that needs double precision isn't met"
    assert peak < 120 * 163, "less than one byte a pixel"


@pytest.mark.parametrize(
    "settings",
    [
        tm.Settings(takes=2),
        tm.Settings(keep="brightness"),
        tm.Settings(estimator="single-frequency"),
    ],
)
def test_what_a_workspace_cannot_do_is_left_to_the_stages(settings: tm.Settings) -> None:
    assert tm.kernels.reconstructor(SHAPE, M, settings) is None


def test_without_lanes_there_is_no_workspace() -> None:
    assert tm.kernels.reconstructor((4, 5), M, tm.Settings()) is None
    with without_lanes():
        assert tm.kernels.reconstructor(SHAPE, M, tm.Settings()) is None
        with lanes(M, precisions=("float32",)):
            assert tm.kernels.reconstructor(SHAPE, M, tm.Settings()) is not None
            assert tm.kernels.reconstructor(SHAPE, M + 1, tm.Settings()) is None


@pytest.mark.parametrize("shape", [(M,), (M + 1, 3, 3), (M + 2, *SHAPE)])
def test_a_calibration_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(tm.ShapeError) as caught:
        tm.kernels.reconstructor(SHAPE, M, tm.Settings(), np.ones(shape))

    assert caught.value.name == "calibration"


@pytest.mark.parametrize("images", [M * 4, (M + 2) * 4])
def test_another_number_of_images_is_refused(images: int) -> None:
    workspace = tm.kernels.reconstructor(SHAPE, M, tm.Settings())
    assert workspace is not None

    with pytest.raises(tm.ShapeError) as caught:
        workspace(np.zeros((images, *SHAPE), np.uint16))

    assert caught.value.name == "images"
    with pytest.raises(tm.ShapeError):
        workspace(np.zeros(((M + 1) * 4, SHAPE[0] + 1, SHAPE[1]), np.uint16))
