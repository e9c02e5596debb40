"""The stages together."""

from dataclasses import replace

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_driver import SubPhases
from transientcam_moments.comparisons import _sra_table as sra_table
from transientcam_moments.likelihood import MODEL_ERROR
from transientcam_moments.reconstruction import ESTIMATORS

SHAPE = (6, 7)
FREQUENCY_HZ = 23e6


def scene(m: int, *, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moments, phases (2, H, W) and weights of a direct and an indirect return everywhere."""
    rng = np.random.default_rng(0)
    phase = np.array([1.0, 3.0])[:, None, None] + 0.01 * rng.random(SHAPE)
    weight = np.array([500.0, 200.0])[:, None, None] * np.ones(SHAPE)
    b = oracles.moments_of_returns(phase, weight, m)
    b += noise * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))
    b[0] = b[0].real + 10
    return b, phase, weight


PLAIN = tm.Settings(base_frequency_hz=FREQUENCY_HZ, smoothing_sigma_px=0.0, estimator="pisarenko")


def test_direct_and_indirect_light_are_separated() -> None:
    b, phase, weight = scene(3)

    result = tm.reconstruct(b, PLAIN)

    assert np.allclose(result.phase_rad, phase[0], atol=1e-3)
    assert np.allclose(result.range_m, tm.range_m(phase[0], FREQUENCY_HZ), atol=1e-3)
    assert np.allclose(result.direct, weight[0], rtol=0.02)
    assert np.allclose(result.indirect, weight[1], rtol=0.03)
    assert np.allclose(result.uniform, 10, rtol=1e-6)
    assert np.allclose(result.validity, 10 / 710)
    assert np.all(result.flags == 0)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("keep", ["harmonics", "brightness"])
@pytest.mark.parametrize("noise", [30.0, 100.0])
def test_light_is_neither_lost_nor_made(dtype: type, keep: str, noise: float) -> None:
    b, _, _ = scene(4, noise=noise)

    result = tm.reconstruct(b.astype(dtype), tm.Settings(keep=keep))

    assert result.flags.max() == tm.Flags.BIASED
    total = result.direct + result.indirect + result.uniform
    assert np.allclose(total, result.brightness, rtol=50 * np.finfo(dtype).eps)
    if keep == "brightness":
        assert np.allclose(result.brightness, result.smoothed[0].real)


@pytest.mark.parametrize("estimator", ["pisarenko", "maximum-entropy", "single-frequency"])
def test_every_estimator_finds_a_single_return(estimator: str) -> None:
    phase = np.linspace(0.1, 6.1, 20)
    b = oracles.moments_of_returns(phase[None], np.full((1, 20), 100.0), 3)

    result = tm.reconstruct(b, tm.Settings(FREQUENCY_HZ, estimator=estimator))

    assert oracles.around(result.phase_rad - phase).max() < 1e-6


RIVALS = [each for each in ESTIMATORS if each not in ("pisarenko", "maximum-entropy")]


@pytest.mark.parametrize("estimator", RIVALS)
def test_a_rival_gives_the_range_image_and_no_light_is_lost(
    estimator: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sra_table, "NODES", 7)  # soon built
    least = tm.Settings(estimator=estimator).least_harmonics
    phase = np.linspace(0.5, 5.5, 6)
    b = oracles.moments_of_returns(phase[None], np.full((1, 6), 100.0), max(least, 3))
    b = b.reshape((-1, 2, 3)).astype(np.complex64)
    b[0] += 5
    b[1, 0, 1] = np.nan

    result = tm.reconstruct(b, tm.Settings(FREQUENCY_HZ, estimator=estimator, smoothing_sigma_px=0))

    seen = np.isfinite(result.range_m)
    assert np.array_equal(seen, result.has_range)
    assert result.flags[0, 1] == tm.Flags.NON_FINITE
    apart = oracles.around(result.phase_rad - phase.reshape((2, 3)))[seen]
    assert apart.max() < (0.1 if estimator == "regularised" else 0.02)
    assert result.range_m.dtype == result.direct.dtype == np.float32
    total = result.direct + result.indirect + result.uniform
    assert np.allclose(total[seen], result.brightness[seen], rtol=1e-5)
    if estimator not in tm.comparisons.TECHNIQUES:
        assert np.allclose(result.direct[seen], 100, rtol=0.05)
    elif estimator != "single-frequency":
        expected = tm.comparisons.TECHNIQUES[estimator].estimate(b).separate(0.1).direct
        assert np.array_equal(result.direct[seen], expected[seen])


@pytest.mark.parametrize("estimator", RIVALS)
def test_an_estimator_without_enough_harmonics_says_how_many_it_needs(estimator: str) -> None:
    least = tm.Settings(estimator=estimator).least_harmonics
    if least == 1:
        return
    b = scene(least - 1)[0]

    result = tm.reconstruct(b, tm.Settings(FREQUENCY_HZ, estimator=estimator))

    for name in ("range_m", "direct", "uniform"):
        with pytest.raises(tm.ParameterError, match=estimator) as caught:
            getattr(result, name)
        assert caught.value.field == "harmonics"
        assert caught.value.value == least - 1
        assert str(least) in caught.value.limit
    assert result.brightness.shape == b.shape[1:]  # all else is there


def test_multipath_disturbs_a_single_frequency_and_not_the_others() -> None:
    b, phase, _ = scene(4)
    error = {
        estimator: np.abs(tm.reconstruct(b, tm.Settings(estimator=estimator)).phase_rad - phase[0])
        for estimator in ("pisarenko", "maximum-entropy", "single-frequency")
    }

    assert error["single-frequency"].min() > 0.2
    assert error["pisarenko"].max() < 0.02
    assert error["maximum-entropy"].max() < 0.02


def test_images_go_through_calibration_to_range() -> None:
    b, phase, _ = scene(3)
    steps = SubPhases("arccos", 8)
    gain = complex(tm.modulation_gain(1, steps.phases_rad))
    low = b[0].real * abs(gain)
    images = [(b[0].real + (low * 1j**-k).real) / 2 for k in range(4)]
    for plane in b[1:]:
        images += [(b[0].real + (plane * gain * 1j**-k).real) / 2 for k in range(4)]
    raw = np.round(np.stack(images)).astype(np.uint16)
    raw[5, 2, 2] = 4095
    calibration = tm.nominal_calibration(3, steps.phases_rad, zeroth="low-frequency")
    settings = replace(PLAIN, zeroth="low-frequency", takes=1)

    result = tm.reconstruct(raw, settings, calibration=calibration)
    listed = tm.reconstruct(list(raw), settings, calibration=calibration)

    others = np.ones(SHAPE, bool)
    others[2, 2] = False
    assert np.abs(result.phase_rad - phase[0])[others].max() < 0.1
    assert result.flags[2, 2] & tm.Flags.SATURATED
    assert not np.any(result.flags[others] & int(tm.Flags.SATURATED))
    assert np.array_equal(listed.flags, result.flags)


def test_an_unmeasured_zeroth_moment_is_estimated() -> None:
    b, phase, _ = scene(3)
    b[0] = 0

    result = tm.reconstruct(
        b, tm.Settings(zeroth="estimated", smoothing_sigma_px=0.0, epsilon=0.01)
    )

    assert np.allclose(result.validity, 0.01)
    assert np.allclose(result.brightness, 700, rtol=0.02)
    assert np.abs(result.phase_rad - phase[0]).max() < 0.01
    assert np.all(result.flags == 0)


def test_a_pixel_without_light_or_with_nan_has_no_range_and_disturbs_no_other() -> None:
    b, _, _ = scene(3)
    clean = tm.reconstruct(b, PLAIN)
    poisoned = b.copy()
    poisoned[:, 1, 1] = 0
    poisoned[2, 3, 3] = np.nan
    bad = np.zeros(SHAPE, bool)
    bad[1, 1] = bad[3, 3] = True

    result = tm.reconstruct(poisoned, PLAIN)

    assert np.array_equal(np.isnan(result.range_m), bad)
    assert np.array_equal(result.has_range, ~bad)
    assert result.flags[1, 1] == tm.Flags.NO_SIGNAL
    assert result.flags[3, 3] == tm.Flags.NON_FINITE
    for name in ("range_m", "direct", "indirect", "uniform", "flags", "validity"):
        assert np.array_equal(getattr(result, name)[~bad], getattr(clean, name)[~bad]), name


def test_density_and_cumulative_are_per_second_and_of_time() -> None:
    b, phase, _ = scene(3)
    result = tm.reconstruct(b, PLAIN)
    turn_s = 1 / FREQUENCY_HZ
    time_s = np.linspace(0, turn_s, 20_001)

    g, light = result.density(time_s), result.cumulative(time_s)

    step = time_s[1]
    assert np.allclose((g[1:] + g[:-1]).sum(axis=0) * step / 2, result.brightness, rtol=1e-4)
    assert np.allclose(light[-1], result.brightness)
    assert np.allclose(time_s[g.argmax(axis=0)], phase[0] / (2 * np.pi) * turn_s, atol=1e-10)
    assert np.allclose(result.density(time_s, evaluation="fourier"), g, rtol=1e-6)


def test_stages_are_computed_once_and_only_when_asked_for() -> None:
    result = tm.reconstruct(scene(2)[0])

    assert "returns" not in vars(result)
    first = result.returns
    assert result.returns is first
    assert "coefficients" not in vars(result)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("base_frequency_hz", 0.0),
        ("zeroth", "none"),
        ("takes", 0),
        ("epsilon", 1.0),
        ("keep", "both"),
        ("smoothing_sigma_px", -1.0),
        ("threshold", 2.0),
        ("estimator", "best"),
    ],
)
def test_settings_refuse_what_no_stage_could_work_with(field: str, value: object) -> None:
    with pytest.raises(tm.ParameterError) as caught:
        tm.Settings(**{field: value})  # type: ignore[arg-type]  # that is the point

    assert caught.value.field == field
    assert caught.value.value == value


def _noisy_pair(seed: int = 0) -> tuple[np.ndarray, tm.noise.MomentNoise]:
    """Return moments (5, 8, 9) of two returns in DN with the noise of the usual sensor."""
    random = np.random.default_rng(seed)
    phase = np.stack([random.uniform(1, 2, (8, 9)), random.uniform(3, 4, (8, 9))])
    b = oracles.moments_of_returns(phase, np.full(phase.shape, 600.0), 4)
    noise = tm.noise.moment_noise(
        b[0].real, tm.noise.Sensor(), calibration=np.ones(5), zeroth="low-frequency", takes=4
    )
    return tm.noise.draw(b, noise, random, draws=1)[:, 0], noise


def test_the_likelihood_weighs_the_moments_by_the_noise_of_the_sensor() -> None:
    b, _ = _noisy_pair()
    settings = tm.Settings(
        FREQUENCY_HZ,
        zeroth="low-frequency",
        takes=4,
        estimator="likelihood",
        sensor=tm.noise.Sensor(),
        smoothing_sigma_px=0.0,
    )
    found = tm.Reconstruction(b, settings)

    noise = tm.noise.moment_noise(
        b[0].real, tm.noise.Sensor(), calibration=np.ones(5), zeroth="low-frequency", takes=4
    )
    expected = tm.likelihood(b, noise, model_error=MODEL_ERROR)
    direct, indirect, phase = expected.separate()
    assert np.array_equal(found.direct, direct)
    assert np.array_equal(found.indirect, indirect)
    assert np.array_equal(found.range_m, tm.range_m(phase, FREQUENCY_HZ))
    assert np.allclose(found.direct + found.indirect + found.uniform, found.brightness)
    assert np.array_equal(found.reduced_chi_square, expected.reduced_chi_square)
    std_m = tm.range_m(expected.direct_phase_std_rad(), FREQUENCY_HZ)
    assert np.array_equal(found.range_std_m, std_m)


def test_gains_and_smoothing_are_in_the_noise_of_a_reconstruction() -> None:
    b, _ = _noisy_pair()
    gains = np.array([1.0, 0.8, 0.6j, 0.5, 0.4])
    settings = tm.Settings(
        zeroth="low-frequency",
        takes=1,
        estimator="likelihood",
        sensor=tm.noise.Sensor(),
        neighbours="gaussian",
    )

    found = tm.reconstruct(b * gains[:, None, None], settings, calibration=gains)

    noise = found.noise
    assert noise is not None
    ratio = noise.variance / noise.variance[0]
    assert np.allclose(ratio, (1 / np.abs(gains) ** 2)[:, None, None])
    raw = tm.noise.moment_noise(
        found.smoothed[0].real, tm.noise.Sensor(), calibration=gains, zeroth="low-frequency"
    )
    expected = tm.noise.smoothed(raw, settings.smoothing_sigma_px)
    assert np.allclose(noise.variance, expected.variance)


@pytest.mark.parametrize("estimator", ["likelihood", "pisarenko"])
def test_returns_that_do_not_explain_the_moments_are_flagged(estimator: str) -> None:
    b, _ = _noisy_pair()
    b[0, :4] *= 2  # half of the light is uniform, which no model of the likelihood has
    b[:, 0, 0] = 0
    known = tm.Settings(
        FREQUENCY_HZ,
        zeroth="low-frequency",
        takes=4,
        estimator=estimator,
        sensor=tm.noise.Sensor(),
        smoothing_sigma_px=0.0,
    )

    flagged = (tm.Reconstruction(b, known).flags & int(tm.Flags.UNEXPLAINED)) > 0
    unknown = tm.Reconstruction(b, replace(known, sensor=None)).flags & int(tm.Flags.UNEXPLAINED)

    expected = np.zeros((8, 9), bool)
    expected[:4] = estimator == "likelihood"
    expected[0, 0] = False  # without light there is nothing to explain
    assert np.array_equal(flagged, expected)
    assert not unknown.any()


def test_merged_returns_are_those_that_the_noise_of_the_sensor_allows() -> None:
    b, noise = _noisy_pair()
    settings = tm.Settings(
        FREQUENCY_HZ,
        zeroth="low-frequency",
        takes=4,
        estimator="pisarenko-merged",
        sensor=tm.noise.Sensor(),
        smoothing_sigma_px=0.0,
    )

    found = tm.Reconstruction(b, settings)

    expected = tm.separate(tm.merge_returns(found.returns, found.noise or noise))
    assert np.array_equal(found.phase_rad, expected.phase_rad)
    assert np.allclose(found.direct + found.indirect + found.uniform, found.brightness)


def test_without_a_sensor_the_likelihood_assumes_the_noise() -> None:
    b, _ = _noisy_pair()
    settings = tm.Settings(estimator="likelihood", smoothing_sigma_px=0.0)

    found = tm.Reconstruction(b, settings)

    assert found.noise is None
    assert np.array_equal(found.direct, tm.likelihood(b).separate().direct)


def test_a_pixel_without_light_has_neither_range_nor_deviation_by_the_likelihood() -> None:
    b, _ = _noisy_pair()
    b[:, 3, 4] = 0
    b[2, 5, 5] = np.nan
    settings = tm.Settings(
        FREQUENCY_HZ,
        zeroth="low-frequency",
        takes=1,
        estimator="likelihood",
        sensor=tm.noise.Sensor(),
        smoothing_sigma_px=0.0,
    )

    found = tm.Reconstruction(b, settings)

    for plane in (found.range_m, found.range_std_m, found.reduced_chi_square):
        assert np.isnan(plane[[3, 5], [4, 5]]).all()
        assert np.isfinite(plane).sum() == b[0].size - 2


@pytest.mark.parametrize("estimator", ["pisarenko", "likelihood", "maximum-entropy"])
def test_moments_as_measured_give_what_their_images_gave(estimator: str) -> None:
    m, takes = 2, 3
    rng = np.random.default_rng(1)
    images = rng.integers(200, 3000, (takes * 4 * (m + 1), *SHAPE)).astype(np.uint16)
    # saturated, and not recovered: what that leaves of the noise only the images tell
    images[4:8, 2, 3] = 4095
    bad = np.zeros(SHAPE, bool)
    bad[4, 4] = True
    gains = rng.uniform(0.5, 1.0, (m + 1, *SHAPE)).astype(np.complex64)
    settings = tm.Settings(
        FREQUENCY_HZ,
        zeroth="low-frequency",
        takes=takes,
        estimator=estimator,
        full_scale=4095.0,
        spoilt_images="keep",
        sensor=tm.noise.Sensor(dark_dn=3000.0),  # so that there is no ambient light
        neighbours="gaussian",
    )
    reconstructor = tm.Reconstructor(settings, calibration=gains, bad_pixels=bad)
    ours = reconstructor(images)
    saturated = np.asarray(ours.flags & tm.Flags.SATURATED, bool)
    assert saturated[2, 3]

    again = reconstructor(tm.Measured(np.array(ours.measured), saturated))

    for name in ("measured", "smoothed", "moments", "flags", "validity", "range_m", "direct"):
        found, expected = getattr(again, name), getattr(ours, name)
        np.testing.assert_allclose(found, expected, rtol=1e-6, err_msg=name)
