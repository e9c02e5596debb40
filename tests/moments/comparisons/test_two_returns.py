"""Techniques for two sharp returns: exact for two, and what the paper says of them otherwise."""

from collections.abc import Callable

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from tests.moments.comparisons import signals
from transientcam_moments.comparisons import SparseEstimate
from transientcam_moments.comparisons._dorrington import dorrington
from transientcam_moments.comparisons._godbaz import godbaz
from transientcam_moments.comparisons._matrix_pencil import matrix_pencil
from transientcam_moments.comparisons._spumic import spumic
from transientcam_moments.comparisons._sra import sra

Estimator = Callable[..., SparseEstimate]
BASE_HZ = 11e6  # as the paper measures for them (Fig. 11)


@pytest.mark.parametrize(
    ("estimate", "m", "pixels"), [(godbaz, 4, 300), (spumic, 6, 300), (dorrington, 2, 25)]
)
def test_two_returns_are_recovered(estimate: Estimator, m: int, pixels: int) -> None:
    rng = np.random.default_rng(m)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=pixels, apart_rad=1.2)

    found = estimate(oracles.moments_of_returns(phase, weight, m))

    closest = 1e-5 if estimate is dorrington else 1e-9
    assert oracles.around(found.phase_rad - phase).max() < closest
    assert np.abs(found.weight / weight - 1).max() < 10 * closest
    assert np.all(found.uniform == 0)


@pytest.mark.parametrize(("estimate", "m"), [(godbaz, 4), (spumic, 6)])
def test_one_return_is_one(estimate: Estimator, m: int) -> None:
    phase = np.array([[0.1, 3.0, 6.2]])

    found = estimate(oracles.moments_of_returns(phase, np.ones((1, 3)), m))

    assert np.all((found.weight > 1e-9).sum(axis=0) == 1)  # rounding may leave a second one
    assert oracles.around(found.phase_rad[0] - phase[0]).max() < 1e-6
    assert found.weight[0] == pytest.approx(np.ones(3), abs=1e-6)


@pytest.mark.parametrize(("estimate", "m"), [(godbaz, 4), (spumic, 6)])
def test_only_the_first_of_three_continuous_returns_is_captured(
    estimate: Estimator, m: int
) -> None:
    # Sec. 6.1 of Fig. 11b: "only capture the first return adequately"
    b = signals.continuous(m, BASE_HZ)

    found = estimate(b)

    time_ns = signals.ns(found.phase_rad, BASE_HZ)
    middle_ns = np.array(signals.CONTINUOUS[0]) + signals.DECAY_NS
    assert len(time_ns) == 2
    assert abs(time_ns[0] - middle_ns[0]) < 1.0
    assert abs(time_ns - middle_ns[1]).min() > 3.0  # none of them is the second


@pytest.mark.parametrize(("estimate", "m", "times"), [(godbaz, 4, 20), (spumic, 6, 4)])
def test_noise_disturbs_them_more_than_the_maximum_entropy_estimate(
    estimate: Estimator, m: int, times: float
) -> None:
    # Sec. 6.1 of Fig. 11a: "quite sensitive to noise", at 70 : 1
    theirs = signals.noisy(signals.sparse(m, BASE_HZ), ratio=70, draws=300, seed=1)
    ours = signals.noisy(signals.sparse(3, 23e6), ratio=70, draws=300, seed=1)

    their_ns = signals.ns(estimate(theirs).first_phase_rad(), BASE_HZ)
    our_ns = signals.ns(tm.peaks(tm.levinson(tm.bias(ours).moments)).first_rad, 23e6)

    assert np.nanstd(their_ns) > times * np.nanstd(our_ns)


def test_the_four_frequency_form_loses_its_digits_as_returns_merge() -> None:
    apart = np.array([1e-1, 1e-2, 1e-3])
    phase = np.stack([np.full(3, 2.0), 2.0 + apart])
    b = oracles.moments_of_returns(phase, np.ones((2, 3)), 4)
    rng = np.random.default_rng(0)
    noise = 1e-12 * (rng.normal(size=(200, *b.shape)) + 1j * rng.normal(size=(200, *b.shape)))

    found = godbaz(np.moveaxis(b + noise, 0, 1))

    # D = -a_1 a_2 z_1 z_2 (z_1 - z_2)^2: about two digits for each one of the distance
    with np.errstate(invalid="ignore"):
        error = np.nanmedian(oracles.around(found.phase_rad - phase[:, None]), axis=(0, 1))
    assert np.all(error[1:] > 20 * error[:-1])


def test_least_squares_on_two_frequencies_agree_with_the_least_brightness() -> None:
    # two positive returns with given b_1 and b_2 are unique: their b_0 makes B singular (Prop. 1)
    b = oracles.random_moments(np.random.default_rng(7), 2, 20)

    found = dorrington(b)

    b[0] = 0
    exact = tm.pisarenko(b)
    two = exact.count == 2
    assert two.sum() > 15
    off = oracles.around(found.phase_rad - exact.phase_rad)[:, two]
    assert np.quantile(off, 0.9) < 1e-4


@pytest.mark.parametrize("m", [3, 4, 5, 7, 9])
def test_the_matrix_pencil_recovers_half_as_many_returns_as_there_are_frequencies(m: int) -> None:
    rng = np.random.default_rng(m)
    returns = (m - 1) // 2
    phase, weight = oracles.random_returns(rng, returns=returns, pixels=100, apart_rad=4 / returns)

    found = matrix_pencil(oracles.moments_of_returns(phase, weight, m))

    assert oracles.around(found.phase_rad - phase).max() < 1e-8
    assert np.abs(found.weight / weight - 1).max() < 1e-8


def test_the_matrix_pencil_needs_more_moments_than_pisarenko() -> None:
    # Sec. 5.1: "more than twice as many measurements", and need not be compatible with them
    phase, weight = np.array([1.0, 2.5, 4.5]), np.array([1.0, 0.5, 0.8])
    b = oracles.moments_of_returns(phase, weight, 4)

    pencil, ours = matrix_pencil(b), tm.pisarenko(b[:4])

    assert oracles.around(ours.phase_rad - phase).max() < 1e-9
    left = oracles.moments_of_returns(np.nan_to_num(pencil.phase_rad), pencil.weight, 4) - b
    assert np.abs(left[1:]).max() > 0.2


def test_the_matrix_pencil_refuses_more_returns_than_it_can_separate() -> None:
    with pytest.raises(tm.ParameterError, match="returns"):
        matrix_pencil(np.ones((5, 1)), returns=2)


def test_exact_moments_with_a_uniform_part_do_not_disturb_techniques_that_ignore_it() -> None:
    phase, weight = np.array([1.0, 3.0]), np.array([1.0, 0.5])
    b = oracles.moments_of_returns(phase, weight, 6)
    b[0] += 5.0

    for estimate in (godbaz, spumic):
        assert estimate(b).phase_rad == pytest.approx(phase, abs=1e-9)
    assert sra(b, epsilon=0).weight[:2] == pytest.approx(weight)
