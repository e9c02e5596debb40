"""Pixels without a signal have no range, whatever the estimator and the way to b_0."""

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments.compiled_kernels import kernels
from transientcam_moments.reconstruction._detection import FALSE_ALARMS, undetected_pixels

F_HZ = 23e6
SHAPE = (48, 64)
SENSOR = tm.noise.Sensor(
    gain_e_per_dn=9.0, full_well_e=40_000.0, read_noise_e=30.0, dark_dn=64.0, bits=12
)


def captured(
    brightness: NDArray[np.float64], zeroth: str, *, m: int = 4, ambient: float = 0.0, seed: int = 1
) -> NDArray[np.uint16]:
    """Return noisy images of one return at a quarter of the period: electrons, then numbers."""
    random = np.random.default_rng(seed)
    signals = []
    if zeroth == "on-off":
        signals += [brightness / 2, 0 * brightness]
    for j in range(0 if zeroth == "low-frequency" else 1, m + 1):
        for phase in tm.images.FOUR_PHASES_RAD:
            wave = np.cos(j * np.pi / 2 - phase) if j else np.cos(0.05 - phase)
            signals.append((brightness + brightness * wave) / 2)
    electrons = random.poisson(9.0 * (np.stack(signals) + ambient)).astype(float)
    electrons += random.normal(0, 30.0, electrons.shape)
    return np.clip(np.rint(electrons / 9.0 + 64.0), 0, 4095).astype(np.uint16)


def settings(estimator: str, zeroth: str, neighbours: str = "gaussian") -> tm.Settings:
    """By default with pixels that share little noise, of which a picture has enough to count."""
    return tm.Settings(
        estimator=estimator,
        zeroth=zeroth,
        takes=1,
        base_frequency_hz=F_HZ,
        sensor=SENSOR,
        neighbours=neighbours,
    )


def halves(left: float, right: float) -> NDArray[np.float64]:
    brightness = np.full(SHAPE, right)
    brightness[:, : SHAPE[1] // 2] = left
    return brightness


INNER = np.s_[:, : SHAPE[1] // 2 - 3], np.s_[:, SHAPE[1] // 2 + 3 :]


@pytest.mark.parametrize("ambient", [0.0, 600.0])
@pytest.mark.parametrize("zeroth", ["estimated", "on-off", "low-frequency"])
@pytest.mark.parametrize(
    "estimator", ["pisarenko", "maximum-entropy", "single-frequency", "likelihood", "two-returns"]
)
def test_black_pixels_have_no_range_and_lit_ones_keep_theirs(
    estimator: str, zeroth: str, ambient: float
) -> None:
    raw = captured(halves(0.0, 400.0), zeroth, ambient=ambient)

    found = tm.reconstruct(raw, settings(estimator, zeroth), calibration=np.ones(5))

    black, lit = (np.isfinite(found.range_m[place]) for place in INNER)
    assert black.mean() <= 0.012  # 0.005, and what few pixels scatter by
    assert lit.mean() >= 0.99
    flagged = found.flags[INNER[0]] & (tm.Flags.NO_SIGNAL | tm.Flags.NON_FINITE)
    np.testing.assert_array_equal(flagged == 0, black)
    np.testing.assert_array_equal(found.has_range, np.isfinite(found.range_m))


@pytest.mark.parametrize("zeroth", ["on-off", "low-frequency"])
def test_as_few_black_pixels_pass_where_dozens_are_averaged(zeroth: str) -> None:
    stated = settings("pisarenko", zeroth, "edge-preserving")
    pictures = (captured(halves(0.0, 400.0), zeroth, ambient=600.0, seed=k) for k in range(10))

    found = [tm.reconstruct(each, stated, calibration=np.ones(5)) for each in pictures]

    # they share noise, and pass in patches: one picture may hold none or a sixth of what ten do
    assert np.mean([each.has_range[INNER[0]] for each in found]) <= 0.009
    assert np.mean([each.has_range[INNER[1]] for each in found]) >= 0.99


@pytest.mark.parametrize("gap", [1.0, 0.5])
def test_ambient_light_of_each_pixel_counts_as_noise(gap: float) -> None:
    """Half of the picture has `gap` times as much signal as noise exceeds, by its own ambient."""
    ambient = np.zeros(SHAPE)
    ambient[:, : SHAPE[1] // 2] = 4000.0
    brightness = np.zeros(SHAPE)

    def noise_of(light: object, ambient: NDArray[np.float64]) -> tm.noise.MomentNoise:
        return tm.noise.MomentNoise(np.ones((2, 1)) * (1.0 + np.asarray(ambient) / 40.0))

    limit = -2 * np.log(FALSE_ALARMS)  # chi-square of two degrees of freedom: exp(-x / 2)
    signal = np.sqrt(gap * 1.001 * limit * (1 + ambient / 40.0))
    moments = np.stack([brightness, signal]) + 0j

    found = undetected_pixels(moments, brightness, noise_of, 0.0, None, ambient)

    assert (found is None) == (gap == 1.0)
    assert found is None or found.all()


@pytest.mark.parametrize("m", [1, 3, 8])
def test_hardly_more_black_pixels_pass_than_is_stated(m: int) -> None:
    raw = np.stack([captured(np.zeros(SHAPE), "estimated", m=m, seed=seed) for seed in range(8)])
    stated = settings("pisarenko", "estimated")

    passed = [tm.reconstruct(each, stated, calibration=np.ones(m + 1)).has_range for each in raw]

    # fewer of many frequencies: what is taken for b_0 of noise makes the noise seem larger
    assert 0.0005 < np.mean(passed) < 0.007


def test_a_gain_that_falls_with_frequency_changes_nothing() -> None:
    gains = np.array([1.0, 0.8, 0.5, 0.3, 0.1])
    raw = captured(halves(0.0, 400.0), "estimated")
    per_pixel = gains[:, None, None] * np.ones(SHAPE)

    found = tm.reconstruct(raw, settings("pisarenko", "estimated"), calibration=gains)
    by_pixel = tm.reconstruct(raw, settings("pisarenko", "estimated"), calibration=per_pixel)

    assert np.isfinite(found.range_m[INNER[0]]).mean() <= 0.012
    np.testing.assert_array_equal(found.flags, by_pixel.flags)


def test_the_compiled_pass_finds_the_same_pixels() -> None:
    raw = captured(halves(0.0, 400.0), "estimated", m=3)  # whose pass other tests compile, too
    stated = settings("pisarenko", "estimated")
    of_numpy = tm.reconstruct(raw, stated, calibration=np.ones(4))
    expected = np.array(of_numpy.has_range)

    with kernels(3, precisions=("float32",), names=("reconstruct",)):
        compiled = tm.reconstruct(raw, stated, calibration=np.ones(4))
        np.testing.assert_array_equal(np.isfinite(compiled.range_m), compiled.has_range)

    assert (compiled.has_range != expected).mean() < 0.001  # rounded at the limit


def test_without_a_sensor_images_tell_their_noise_and_moments_alone_have_none() -> None:
    raw = captured(np.zeros(SHAPE), "estimated")
    stated = tm.Settings(estimator="pisarenko", zeroth="estimated", takes=1, base_frequency_hz=F_HZ)

    assert tm.reconstruct(raw, stated, calibration=np.ones(5)).has_range.mean() < 0.01
    moments = tm.measure(raw, zeroth="estimated")
    assert tm.reconstruct(moments, stated, calibration=np.ones(5)).has_range.mean() > 0.99


def test_uniform_light_has_no_signal() -> None:
    found = tm.reconstruct(np.array([[2.0, 2.0], [0.0, 1.0]]) + 0j, tm.Settings(F_HZ))

    assert (found.flags & tm.Flags.NO_SIGNAL > 0).tolist() == [True, False]


@pytest.mark.parametrize("kind", ["raw", "moments"])
def test_masked_pixels_have_no_value(kind: str) -> None:
    raw = captured(np.full(SHAPE, 400.0), "estimated")
    mask = np.zeros(SHAPE, dtype=bool)
    mask[5, 7] = True
    data = raw if kind == "raw" else tm.measure(raw, zeroth="estimated")
    masked = np.ma.masked_array(data, np.broadcast_to(mask, data.shape))

    found = tm.reconstruct(masked, settings("pisarenko", "estimated"), calibration=np.ones(5))

    np.testing.assert_array_equal(np.isnan(found.range_m), mask)
    assert np.isnan(tm.density(found.coefficients, np.array([1.0]))[0, 5, 7])


def test_a_pixel_whose_saturated_images_the_others_tell_keeps_its_range() -> None:
    raw = captured(np.full(SHAPE, 3300.0), "estimated", ambient=800.0)
    assert ((raw == 4095).any(axis=0)).mean() > 0.5

    found = tm.reconstruct(raw, settings("single-frequency", "estimated"), calibration=np.ones(5))

    saturated = (found.flags & tm.Flags.SATURATED) > 0
    np.testing.assert_array_equal(saturated, (raw == 4095).any(axis=0))
    np.testing.assert_allclose(found.range_m, tm.range_m(np.pi / 2, F_HZ), atol=0.02)


def test_a_pixel_all_of_whose_images_may_be_cut_off_has_no_range() -> None:
    raw = captured(halves(40_000.0, 400.0), "estimated")

    found = tm.reconstruct(raw, settings("pisarenko", "estimated"), calibration=np.ones(5))

    assert np.isnan(found.range_m[INNER[0]]).all()
    assert ((found.flags[INNER[0]] & tm.Flags.SATURATED) > 0).all()
    assert np.median(found.range_m[INNER[1]]) == pytest.approx(
        tm.range_m(np.pi / 2, F_HZ), abs=0.01
    )
