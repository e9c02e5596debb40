"""The compiled pass over a frame against the stages one by one."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.compiled_kernels import kernels, without_kernels
from transientcam_moments._dispatch import KERNELS
from transientcam_moments.images import harmonics_of
from transientcam_moments.reconstruction._one_pass import PassedReconstruction

ORDERS = (3, 8)
M = 3
SHAPE = (37, 53)
Array = NDArray[Any]


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with kernels(*ORDERS, precisions=("float32",)):
        yield


def settings_of(**changes: Any) -> tm.Settings:
    """Return the paper's settings with all that raw images need, one take at a low frequency."""
    labels: dict[str, Any] = {"base_frequency_hz": 23e6, "zeroth": "low-frequency", "takes": 1}
    return tm.Settings(**(labels | {"estimator": "pisarenko", "neighbours": "gaussian"} | changes))


@contextmanager
def stage_by_stage() -> Iterator[None]:
    """Leave out the pass inside, and keep all other kernels."""
    before = dict(KERNELS.compiled)
    for key in before:
        if key.name == "reconstruct":
            del KERNELS.compiled[key]
    try:
        yield
    finally:
        KERNELS.compiled.update(before)


def raw_images(
    settings: tm.Settings, m: int = M, *, shape: tuple[int, int] = SHAPE, seed: int = 0
) -> Array:
    """Three returns a pixel that vary over the image, with noise, and some special pixels."""
    y, x = np.mgrid[: shape[0], : shape[1]] / max(shape)
    phase_rad = np.stack([1 + 1.5 * x + 0.5 * y, 2.5 + x * y, 4 + x])
    weight = np.stack([800 + 600 * np.sin(6 * x), 300 + 300 * y, 150 + 0 * x])
    b = np.stack([(weight * np.exp(1j * j * phase_rad)).sum(0) for j in range(m + 1)])
    images = digitised(b, str(settings.zeroth), seed=seed)
    images[:, 3, 5] = 0  # a dead pixel
    images[2, 7, 7] = 4095  # a saturated one
    images[:, 20:24, 30:40] = 50  # darkness
    images[6, 30, 30] = 3000  # contradictory data
    return images


def digitised(b: Array, zeroth: str, *, seed: int = 0) -> Array:
    """Return raw images (N, H, W) of moments in DN, with shot noise and read noise of 2 DN."""
    rng = np.random.default_rng(seed)
    step = np.exp(-0.5j * np.pi * np.arange(4))[:, None, None]
    first = {
        "low-frequency": [50 + (b[0].real + np.real(b[0] * step)) / 2],
        "on-off": [np.stack([50 + b[0].real / 2, 50 + 0 * b[0].real])],
        "estimated": [],
    }[zeroth]
    images = np.concatenate([*first, *(50 + (b[0].real + np.real(c * step)) / 2 for c in b[1:])])
    images = rng.poisson(images) + rng.normal(0, 2, images.shape)
    return np.clip(np.round(images), 0, 4095).astype(np.uint16)


def gains(kind: str, m: int = M, shape: tuple[int, ...] = SHAPE) -> Array:
    rng = np.random.default_rng(1)
    if kind == "none":
        return np.ones(m + 1)
    gain = 1 + 0.1 * (rng.normal(size=m + 1) + 1j * rng.normal(size=m + 1))
    gain[0] = gain[0].real
    if kind == "frequencies":
        return gain
    gain = gain[:, None, None] * (1 + 0.01 * rng.normal(size=(m + 1, *shape)))
    gain[1, 20, 20], gain[2, 21, 40] = 0, np.nan  # dead pixels of the calibration
    return gain


def bad_pixels(kind: str) -> Array | None:
    """None, all, or a cluster, one in a corner, one saturated and one without calibration."""
    if kind == "none":
        return None
    bad = np.full(SHAPE, kind == "all")
    bad[7, 7] = bad[0, 0] = bad[20, 20] = True
    bad[10:14, 11:16] = True
    return bad


def with_gains(data: Any, settings: tm.Settings, prepared: dict[str, Any]) -> dict[str, Any]:
    """Return what a reconstructor is prepared with, raw images without a gain with one of 1."""
    if np.iscomplexobj(data):
        return prepared
    m = harmonics_of(len(data) // (settings.takes or 1), str(settings.zeroth))
    return {"calibration": np.ones(m + 1)} | prepared


def reconstructed(data: Any, settings: tm.Settings, **kwargs: Any) -> tm.Reconstruction:
    saturated = kwargs.pop("saturated_pixels", None)
    prepared = with_gains(data, settings, kwargs)
    return tm.reconstruct(data, settings, saturated_pixels=saturated, **prepared)


def in_one_pass(
    data: Any, settings: tm.Settings, saturated: Array | None = None, **kwargs: Any
) -> tm.Reconstruction:
    prepared = with_gains(data, settings, kwargs)
    found = tm.Reconstructor(settings, **prepared)(data, saturated_pixels=saturated)
    assert isinstance(found, PassedReconstruction)
    return found


PROPERTIES: dict[str, Callable[[tm.Reconstruction], Array]] = {
    "measured": lambda found: found.measured,
    "smoothed": lambda found: found.smoothed,
    "eigenvalue": lambda found: found.eigenvalue,
    "validity": lambda found: found.validity,
    "moments": lambda found: found.moments,
    "brightness": lambda found: found.brightness,
    "uniform": lambda found: found.uniform,
    "direct": lambda found: found.direct,
    "indirect": lambda found: found.indirect,
    "phase": lambda found: np.exp(1j * found.phase_rad),
    "range": lambda found: found.range_m,
    "error": lambda found: found.coefficients.error,
    "polynomial": lambda found: found.coefficients.polynomial,
    "reflection": lambda found: found.coefficients.reflection,
    "weights": lambda found: found.returns.weight,
    "density": lambda found: found.density(np.linspace(0, 4e-8, 5)),
    "cumulative": lambda found: found.cumulative(np.linspace(0, 4e-8, 5)),
    "first peak": lambda found: np.exp(1j * found.peaks.first_rad),
}


def assert_same(found: tm.Reconstruction, expected: tm.Reconstruction) -> None:
    """The numbers of both are the same but for rounding, and their flags without exception."""
    assert np.array_equal(found.flags, expected.flags)
    assert np.array_equal(found.has_range, expected.has_range)
    assert np.array_equal(found.returns.count, expected.returns.count)
    assert found.rejected_images == expected.rejected_images
    finite = (found.flags & int(tm.Flags.NON_FINITE)) == 0
    for name, read in PROPERTIES.items():
        value, stage = read(found)[..., finite], read(expected)[..., finite]
        assert value.dtype == stage.dtype, name
        assert np.array_equal(np.isnan(value), np.isnan(stage)), name
        of = expected.brightness[finite] if name in ("error", "uniform") else stage
        scale = np.nanmax(np.abs(of), initial=1e-30)
        error = np.nan_to_num(np.abs(value - stage)) / scale
        # where the uniform part is weak, conditions are bad and rounding of the moments counts
        assert error.max(initial=0) < 2e-3, name
        assert np.median(error) < 3e-6, name


SETTINGS = [
    settings_of(),
    settings_of(smoothing_sigma_px=0.0),
    settings_of(smoothing_sigma_px=1.3, epsilon=0.05),
    settings_of(zeroth="on-off", minimum_brightness=500.0),
    settings_of(zeroth="estimated"),
    settings_of(zeroth="estimated", smoothing_sigma_px=0.0),
    settings_of(threshold=0.6, base_frequency_hz=11e6, full_scale=900.0),
]


@pytest.mark.parametrize("bad", ["none", "some", "all"])
@pytest.mark.parametrize("calibration", ["none", "frequencies", "pixels"])
@pytest.mark.parametrize("settings", SETTINGS, ids=range(len(SETTINGS)))
def test_a_pass_gives_what_the_stages_give(
    settings: tm.Settings, calibration: str, bad: str
) -> None:
    images = raw_images(settings)
    prepared: dict[str, Any] = {"calibration": gains(calibration), "bad_pixels": bad_pixels(bad)}

    found = in_one_pass(images, settings, **prepared)

    with stage_by_stage():
        assert_same(found, reconstructed(images, settings, **prepared))


@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
@pytest.mark.parametrize("m", ORDERS)
def test_every_order_has_its_pass(m: int, zeroth: str) -> None:
    settings = settings_of(zeroth=zeroth)
    images, gain = raw_images(settings, m), gains("pixels", m)

    found = in_one_pass(images, settings, calibration=gain)

    with stage_by_stage():
        assert_same(found, reconstructed(images, settings, calibration=gain))


@pytest.mark.parametrize("settings", SETTINGS, ids=range(len(SETTINGS)))
def test_a_pass_gives_what_numpy_gives(settings: tm.Settings) -> None:
    images, gain = raw_images(settings), gains("pixels")

    found = in_one_pass(images, settings, calibration=gain)

    with without_kernels():
        expected = reconstructed(images, settings, calibration=gain)
        flags, count = expected.flags, expected.returns.count
        stages = {
            "validity": (expected.validity, 1.0),
            "uniform": (expected.uniform, 1.0),
            "brightness": (expected.brightness, None),
            "direct": (expected.direct, None),
            "indirect": (expected.indirect, None),
            "range_m": (expected.range_m, 1.0),
        }
        brightness = float(np.nanmax(expected.brightness))
    assert np.array_equal(found.flags, flags)
    assert np.array_equal(found.returns.count, count)
    finite = (flags & int(tm.Flags.NON_FINITE)) == 0
    for name, (stage, scale) in stages.items():
        value = getattr(found, name)
        assert np.array_equal(np.isnan(value[finite]), np.isnan(stage[finite])), name
        error = np.abs(value[finite] - stage[finite]) / (scale or brightness)
        assert np.nanmax(error) < 2e-3, name
        assert np.nanmedian(error) < 2e-6 * (brightness if scale else 1), name


@pytest.mark.data
@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
@pytest.mark.parametrize("m", ORDERS)
def test_measured_light_is_reconstructed_alike(m: int, zeroth: str, data_dir: Path) -> None:
    """Single-photon responses of a bare and of two hidden targets, mixed over an image."""
    names = ("capture_direct", "capture_1_0_inch", "capture_3_0_inch")
    spectra = [spectrum(data_dir / "measured" / f"{name}.npz", m) for name in names]
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] / max(SHAPE)
    weight = np.stack([0.1 + x, 0.5 - 0.4 * y, 0.6 * x * y]) * 1500
    turn = np.exp(2j * np.pi * 23e6 * np.arange(m + 1)[:, None, None] * (3e-9 + 8e-9 * x))
    b = sum(s[:, None, None] * w * turn for s, w in zip(spectra, weight, strict=True))
    settings = settings_of(zeroth=zeroth)
    images = digitised(np.asarray(b), zeroth)

    found = in_one_pass(images, settings)

    with stage_by_stage():
        assert_same(found, reconstructed(images, settings))
    assert np.mean(found.has_range) == 1


@pytest.mark.data
@pytest.mark.parametrize("smoothing_px", [0.0, 0.6])
def test_a_measured_scan_is_reconstructed_alike(data_dir: Path, smoothing_px: float) -> None:
    """A scan of 32 x 32 points through foam, each with a response of its own."""
    with np.load(data_dir / "measured" / "scene_letter_s.npz") as file:
        counts, bin_s = file["meas"].astype(float), float(file["bin_s"])
    time_s = bin_s * np.arange(counts.shape[-1])
    turn = np.exp(2j * np.pi * 100e6 * np.arange(M + 1)[:, None] * time_s)
    b = np.einsum("yxt,jt->jyx", counts, turn) * (2000 / counts.sum(axis=-1).max())
    settings = settings_of(base_frequency_hz=100e6, smoothing_sigma_px=smoothing_px)
    images = digitised(b, str(settings.zeroth))

    found = in_one_pass(images, settings)

    with stage_by_stage():
        assert_same(found, reconstructed(images, settings))


def spectrum(path: Path, m: int) -> Array:
    """Return the moments (m + 1) of a response at 23 MHz, of brightness 1."""
    with np.load(path) as file:
        counts, bin_s = file["counts"].astype(float), float(file["bin_s"])
    counts = np.maximum(counts - np.median(counts), 0)
    angle = 2 * np.pi * 23e6 * bin_s * np.arange(counts.size)
    moments = np.exp(1j * np.arange(m + 1)[:, None] * angle) @ counts
    return np.asarray(moments / counts.sum())


def varied_moments(dtype: type = np.complex64) -> Array:
    """Moments of a frame, with pixels that are not finite, dark or contradictory."""
    settings = settings_of(smoothing_sigma_px=0.0)
    b: Array = np.array(reconstructed(raw_images(settings), settings).measured, dtype)
    b[0, 9, 9] = np.nan
    b[2, 9, 19] = np.inf
    b[:, 9, 29] = 0
    b[0, 9, 39] *= -1
    return b


@pytest.mark.parametrize("bad", ["none", "some"])
@pytest.mark.parametrize("settings", SETTINGS, ids=range(len(SETTINGS)))
def test_moments_are_reconstructed_alike(settings: tm.Settings, bad: str) -> None:
    b, mask = varied_moments(), bad_pixels(bad)
    before = b.copy()

    found = in_one_pass(b, settings, given_saturation(), bad_pixels=mask)

    with stage_by_stage():
        expected = reconstructed(b, settings, saturated_pixels=given_saturation(), bad_pixels=mask)
        assert_same(found, expected)
    assert np.array_equal(b, before, equal_nan=True), "the caller's moments stay as they are"


def given_saturation() -> Array:
    mask = np.zeros(SHAPE, bool)
    mask[::5, ::7] = True
    return mask


@pytest.mark.parametrize("plane", [0, 1])
def test_moments_whose_density_overflows_are_flagged_alike(plane: int) -> None:
    b = varied_moments()
    b[plane, 5, :] = np.geomspace(1e28, 3e38, SHAPE[1])
    settings = settings_of(smoothing_sigma_px=0.0)

    found = in_one_pass(b, settings)

    with stage_by_stage():
        assert np.array_equal(found.flags, reconstructed(b, settings).flags)
    non_finite = (found.flags[5] & int(tm.Flags.NON_FINITE)) > 0
    assert non_finite.any()
    assert not non_finite.all()


@pytest.mark.parametrize("zeroth", ["low-frequency", "estimated"])
def test_pixels_in_a_row_are_reconstructed_alike(zeroth: str) -> None:
    settings = settings_of(zeroth=zeroth)
    images = raw_images(settings)
    row = images.reshape((len(images), -1))

    found = in_one_pass(row, settings)

    with stage_by_stage():
        assert_same(found, reconstructed(row, settings))


@pytest.mark.parametrize("bad", ["none", "some"])
def test_takes_and_other_images_join_behind_the_smoothing(bad: str) -> None:
    settings = settings_of(takes=4)
    takes = np.concatenate([raw_images(settings, seed=seed) for seed in range(4)])
    takes[5] //= 2  # an outlier
    prepared: dict[str, Any] = {"calibration": gains("pixels"), "bad_pixels": bad_pixels(bad)}
    narrow = np.ascontiguousarray(raw_images(settings_of())[:, :, :20])

    found = in_one_pass(takes, settings, **prepared)
    floats = in_one_pass(takes[:16].astype(np.float32), settings_of(), **prepared)
    narrowed = in_one_pass(narrow, settings_of())

    with stage_by_stage():
        assert_same(found, reconstructed(takes, settings, **prepared))
        assert_same(floats, reconstructed(takes[:16], settings_of(), **prepared))
        assert_same(narrowed, reconstructed(narrow, settings_of()))
    assert found.rejected_images == 1


def test_saturated_pixels_can_be_given() -> None:
    settings = settings_of(full_scale=100.0)
    images = raw_images(settings)

    found = in_one_pass(images, settings, given_saturation(), bad_pixels=bad_pixels("some"))

    saturated = (found.flags & int(tm.Flags.SATURATED)) > 0
    assert np.array_equal(saturated, given_saturation())


@pytest.mark.parametrize("estimator", ["likelihood", "pisarenko-merged"])
def test_another_estimator_s_range_and_light_are_its_own_in_a_pass(estimator: str) -> None:
    settings = settings_of(estimator=estimator, sensor=tm.noise.Sensor())
    images = raw_images(settings)

    found = in_one_pass(images, settings)

    with stage_by_stage():
        expected = reconstructed(images, settings, calibration=np.ones(M + 1))
    for name in ("range_m", "direct", "indirect"):
        mine, theirs = getattr(found, name), getattr(expected, name)
        assert np.isclose(mine, theirs, rtol=1e-3, equal_nan=True).mean() > 0.99, name
    pisarenko = in_one_pass(images, settings_of())
    assert np.mean(np.abs(found.range_m - pisarenko.range_m) > 0.001) > 0.01


def test_light_is_complete() -> None:
    found = in_one_pass(raw_images(settings_of()), settings_of())

    total = found.direct + found.indirect + found.uniform
    assert np.allclose(total, found.brightness, rtol=1e-4, atol=1e-2)
    assert np.allclose(found.returns.weight.sum(axis=0), found.direct + found.indirect, rtol=1e-5)


@pytest.mark.parametrize("parts", [2, 3])
def test_threads_within_a_frame_change_nothing(parts: int) -> None:
    settings = settings_of()
    images = raw_images(settings, shape=(256, 320))
    reconstructor = tm.Reconstructor(settings, calibration=np.ones(M + 1))
    alone = reconstructor(images)

    with ThreadPoolExecutor(2) as executor:
        together = reconstructor(images, spread=tm.kernels.over(executor, parts))

    assert_equal(alone, together)


def assert_equal(one: tm.Reconstruction, other: tm.Reconstruction) -> None:
    """Both are the same to the last bit."""
    for name, read in PROPERTIES.items():
        assert np.array_equal(read(one), read(other), equal_nan=True), name
    assert np.array_equal(one.flags, other.flags)
    assert np.array_equal(one.returns.phase_rad, other.returns.phase_rad, equal_nan=True)


def test_frames_at_the_same_time_do_not_disturb_each_other() -> None:
    settings = settings_of()
    frames = [raw_images(settings, shape=(120, 163), seed=seed) for seed in range(4)]
    reconstructor = tm.Reconstructor(settings, calibration=np.ones(M + 1))
    alone = [reconstructed(images, settings) for images in frames]

    with ThreadPoolExecutor(4) as executor:
        together = list(executor.map(reconstructor, frames * 4))

    for index, found in enumerate(together):
        assert_equal(found, alone[index % 4])


def test_a_result_stays_as_it_is_while_later_frames_come() -> None:
    settings = settings_of()
    reconstructor = tm.Reconstructor(settings, calibration=np.ones(M + 1))
    images = raw_images(settings)
    first = reconstructor(images)
    kept = {name: read(first).copy() for name, read in PROPERTIES.items()}
    flags = first.flags.copy()

    for seed in range(1, 4):
        reconstructor(raw_images(settings, seed=seed) // 3)

    for name, read in PROPERTIES.items():
        assert np.array_equal(read(first), kept[name], equal_nan=True), name
    assert np.array_equal(first.flags, flags)
    assert_equal(reconstructor(images), first)


def test_frames_of_several_shapes_take_turns() -> None:
    settings = settings_of()
    shapes = [(37, 53), (8, 40), (40, 33), (9, 64), (10, 65), (37, 53)]
    for m in ORDERS:
        reconstructor = tm.Reconstructor(settings, calibration=np.ones(m + 1))
        for shape in shapes:
            images = np.ascontiguousarray(raw_images(settings, m)[:, : shape[0], : shape[1]])
            images = np.resize(images, (len(images), *shape))
            assert_equal(reconstructor(images), reconstructed(images, settings))


@pytest.mark.parametrize(
    "settings",
    [
        settings_of(keep="brightness"),
        settings_of(estimator="single-frequency"),
        settings_of(estimator="maximum-entropy"),
    ],
)
def test_what_a_pass_cannot_do_is_left_to_the_stages(settings: tm.Settings) -> None:
    found = tm.Reconstructor(settings, calibration=np.ones(M + 1))(raw_images(settings))

    assert not isinstance(found, PassedReconstruction)
    with without_kernels():
        expected = reconstructed(raw_images(settings), settings)
        assert np.array_equal(found.flags, expected.flags)
        assert np.nanmax(np.abs(found.direct - expected.direct)) < 1


def test_double_precision_few_pixels_and_other_orders_are_left_to_the_stages() -> None:
    plain = settings_of()
    for data in (
        varied_moments(np.complex128),
        varied_moments()[:, :7, :9],
        raw_images(plain, 5),
        raw_images(plain).astype(np.float64),
    ):
        assert not isinstance(reconstructed(data, plain), PassedReconstruction)


def test_a_reconstructor_changes_over_when_its_kernel_is_there() -> None:
    reconstructor = tm.Reconstructor(settings_of(), calibration=np.ones(M + 1))
    images = raw_images(settings_of())

    with without_kernels():
        before = reconstructor(images)
    after = reconstructor(images)

    assert not isinstance(before, PassedReconstruction)
    assert isinstance(after, PassedReconstruction)


@pytest.mark.parametrize("shape", [(M,), (M + 1, 3, 3), (M + 2, *SHAPE)])
def test_a_calibration_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    reconstructor = tm.Reconstructor(settings_of(), calibration=np.ones(shape))

    with pytest.raises(tm.ShapeError) as caught:
        reconstructor(raw_images(settings_of()))

    assert caught.value.name == "calibration"


@pytest.mark.parametrize("mask", [np.ones((3, 3), bool), np.ones(SHAPE), np.ones(53, bool)])
def test_a_mask_of_another_shape_or_type_is_refused(mask: Array) -> None:
    reconstructor = tm.Reconstructor(settings_of(), calibration=np.ones(M + 1), bad_pixels=mask)

    with pytest.raises(tm.ShapeError) as caught:
        reconstructor(raw_images(settings_of()))

    assert caught.value.name == "bad"


def test_another_number_of_images_is_refused() -> None:
    reconstructor = tm.Reconstructor(settings_of(), calibration=np.ones(M + 1))

    with pytest.raises(tm.ShapeError) as caught:
        reconstructor(np.zeros((M * 4 + 1, *SHAPE), np.uint16))

    assert caught.value.name == "images"
