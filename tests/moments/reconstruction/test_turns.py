"""Where a turn of the phase begins, and which one a range is in: against ranges that were drawn."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm

_Array = NDArray[Any]
LOW_HZ, SHAPE, SCALE_DN = 0.9e6, (12, 20), 800.0
FOUR = ("likelihood", "pisarenko", "maximum-entropy", "single-frequency")
ARCCOS_RAD = tuple(math.acos(1 - (2 * k + 1) / 8) for k in range(8))


def captured(
    ranges_m: tuple[float, ...],
    weights: tuple[float, ...] = (1.0,),
    *,
    base_hz: float = 23e6,
    m: int = 4,
    snr: float = 100.0,
    delay_s: float = 0.0,
    sub_phases_rad: tuple[float, ...] = (0.0,),
    seed: int = 1,
) -> tuple[_Array, dict[str, Any]]:
    """Return noisy images of light at a range, and what they show; b_0 is measured at LOW_HZ."""
    random, images, labels = np.random.default_rng(seed), [], []
    for j in range(m + 1):
        frequency_hz = j * base_hz or LOW_HZ
        for step in range(4):
            lag = [2 * np.pi * frequency_hz * (2 * r / tm.SPEED_OF_LIGHT_M_S) for r in ranges_m]
            lag = [each + 2 * np.pi * frequency_hz * delay_s - step * np.pi / 2 for each in lag]
            wave = [
                w * np.mean(np.cos(np.subtract(each, sub_phases_rad)))
                for w, each in zip(weights, lag, strict=True)
            ]
            light = SCALE_DN * (sum(weights) + sum(wave)) / 2
            noise = random.normal(0.0, SCALE_DN * sum(weights) / 2 / snr, SHAPE)
            images.append(np.round(100 + light + noise).astype(np.uint16))
            labels.append((j, step * np.pi / 2, frequency_hz))
    harmonic, phase_rad, hz = np.array(labels).T
    return np.array(images), {
        "harmonic": harmonic.astype(int),
        "phase_rad": phase_rad,
        "frequency_hz": hz,
    }


def found(
    estimator: str, *args: Any, least_range_m: float = 0.0, **options: Any
) -> tm.Reconstruction:
    """Reconstruct such images with nominal gains."""
    images, labels = captured(*args, **options)
    gain = tm.nominal_calibration(
        options.get("m", 4), options.get("sub_phases_rad", (0.0,)), zeroth="low-frequency"
    )
    base_hz, delay_s = options.get("base_hz", 23e6), options.get("delay_s", 0.0)
    gain = gain * np.exp(2j * np.pi * base_hz * delay_s * np.arange(len(gain)))
    settings = tm.Settings(estimator=estimator, full_scale=65535, least_range_m=least_range_m)
    return tm.reconstruct(images, settings, **labels, calibration=gain)


@pytest.mark.parametrize("estimator", FOUR)
@pytest.mark.parametrize(("base_hz", "m"), [(11.5e6, 1), (23e6, 4), (46e6, 3), (23e6, 8)])
def test_a_range_is_in_the_turn_that_the_low_frequency_tells(
    estimator: str, base_hz: float, m: int
) -> None:
    for range_m in (0.9, 7.4, 41.0):
        image = found(estimator, (range_m,), base_hz=base_hz, m=m, snr=50.0)
        assert np.asarray(image.has_range).all()
        np.testing.assert_allclose(image.range_m, range_m, atol=0.4)


def test_noise_of_a_twentieth_takes_no_pixel_to_another_turn() -> None:
    for base_hz in (23e6, 46e6):
        image = found("likelihood", (7.4,), base_hz=base_hz, snr=20.0)
        np.testing.assert_allclose(image.range_m, 7.4, atol=0.3)


def test_without_a_low_frequency_a_range_is_in_the_first_turn() -> None:
    images, labels = captured((7.4,))
    images, labels = images[4:], {name: values[4:] for name, values in labels.items()}
    gain = tm.nominal_calibration(4, zeroth="estimated")
    image = tm.reconstruct(images, tm.Settings(full_scale=65535), **labels, calibration=gain)
    turn_m = tm.SPEED_OF_LIGHT_M_S / 2 / 23e6
    np.testing.assert_allclose(image.range_m, 7.4 - turn_m, atol=0.05)


def test_sub_phases_and_delay_of_the_gains_do_not_count_as_turns() -> None:
    for m in (2, 4):
        image = found("likelihood", (7.4,), m=m, delay_s=9e-9, sub_phases_rad=ARCCOS_RAD)
        np.testing.assert_allclose(image.range_m, 7.4, atol=0.1)


def test_a_delay_that_one_gain_cannot_tell_leaves_the_turn_alone() -> None:
    image = found("single-frequency", (7.4,), m=1, delay_s=9e-9)
    turn_m = tm.SPEED_OF_LIGHT_M_S / 2 / 23e6
    np.testing.assert_allclose(image.range_m, 7.4 - turn_m, atol=0.1)


@pytest.mark.parametrize("estimator", ["likelihood", "pisarenko", "maximum-entropy"])
def test_later_light_of_the_next_turn_does_not_come_first(estimator: str) -> None:
    image = found(estimator, (5.5, 7.6), (1.0, 0.6), snr=200.0)
    right = abs(np.asarray(image.range_m) - 5.5) < 0.1
    assert right.mean() > 0.98
    if estimator != "maximum-entropy":  # whose direct light is that of Pisarenko's returns
        np.testing.assert_allclose(np.median(image.direct), SCALE_DN, rtol=0.1)


def test_light_of_two_turns_that_one_phase_mixes_has_no_range_and_a_flag() -> None:
    image = found("single-frequency", (1.0, 7.517), (1.0, 1.0))
    without = np.isnan(np.asarray(image.range_m))
    assert without.mean() > 0.9
    np.testing.assert_array_equal(np.asarray(image.has_range), ~without)
    np.testing.assert_array_equal((image.flags & tm.Flags.CONTRADICTORY) > 0, without)


@pytest.mark.parametrize("estimator", FOUR)
@pytest.mark.parametrize("least_range_m", [0.0, 0.3])
def test_noise_puts_no_wall_to_the_other_end(estimator: str, least_range_m: float) -> None:
    turn_m = tm.SPEED_OF_LIGHT_M_S / 2 / 23e6
    images, labels = captured((turn_m,), snr=50.0)
    images, labels = images[4:], {name: values[4:] for name, values in labels.items()}
    gain = tm.nominal_calibration(4, zeroth="estimated")
    settings = tm.Settings(estimator=estimator, full_scale=65535, least_range_m=least_range_m)
    image = tm.reconstruct(images, settings, **labels, calibration=gain)
    expected_m = turn_m if least_range_m else 0.0
    np.testing.assert_allclose(np.median(image.range_m), expected_m, atol=0.01)
    assert np.ptp(np.asarray(image.range_m)) < 0.6


@pytest.mark.parametrize("estimator", ["likelihood", "pisarenko", "two-returns"])
@pytest.mark.parametrize(("least_range_m", "weight"), [(0.0, 1.0), (-0.1, 0.4)])
def test_light_just_before_zero_comes_before_light_behind_it(
    estimator: str, least_range_m: float, weight: float
) -> None:
    image = found(estimator, (-0.01, 1.04), (weight, 1.0), snr=200.0, least_range_m=least_range_m)
    assert (abs(np.asarray(image.range_m) + 0.01) < 0.1).mean() > 0.98
    np.testing.assert_allclose(np.median(image.direct), weight * SCALE_DN, rtol=0.1)


def test_weak_later_light_near_the_end_of_a_turn_does_not_come_first() -> None:
    image = found("likelihood", (2.0, 6.47), (1.0, 0.4), snr=200.0)
    np.testing.assert_allclose(image.range_m, 2.0, atol=0.05)


def test_a_least_range_beyond_a_turn_begins_there() -> None:
    images, labels = captured((7.4,))
    images, labels = images[4:], {name: values[4:] for name, values in labels.items()}
    gain, settings = np.ones(5), tm.Settings(full_scale=65535, least_range_m=7.0)
    image = tm.reconstruct(images, settings, **labels, calibration=gain)
    np.testing.assert_allclose(image.range_m, 7.4, atol=0.05)


@pytest.mark.parametrize("estimator", [*FOUR, "two-returns", "unwrapped-phase"])
@pytest.mark.parametrize("scale", [1e-310, 1e-320])
def test_subnormal_moments_have_no_range_and_a_flag(estimator: str, scale: float) -> None:
    b = np.exp(1j * np.arange(5))[:, None] * np.full(3, scale)
    image = tm.reconstruct(b, tm.Settings(estimator=estimator, base_frequency_hz=23e6))
    assert np.isnan(image.range_m).all()
    assert (np.asarray(image.flags) & tm.Flags.NO_SIGNAL).all()
