"""Techniques that need many frequencies, or high ones."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.comparisons import grid_rad
from transientcam_moments.comparisons._frequency_domain import frequency_domain
from transientcam_moments.comparisons._inverse_fourier import inverse_fourier
from transientcam_moments.comparisons._matching_pursuit import matching_pursuit
from transientcam_moments.comparisons._single_frequency import high_frequency, single_frequency

# -- inverse Fourier ------------------------------------------------------------------------------


@pytest.mark.parametrize("m", [1, 4, 16])
def test_the_plain_series_has_the_moments_and_is_no_density(m: int) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 10)
    b[:, 0] = np.exp(2j * np.arange(m + 1))  # one sharp return rings

    found = inverse_fourier(b, window="none", correction="none")

    assert oracles.moments_of_density(found.density, grid_rad(256), m) == pytest.approx(b)
    assert found.density[:, 0].min() < 0


def test_a_slow_response_is_recovered_exactly() -> None:
    phase = grid_rad(256)
    slow = 1 + 0.6 * np.cos(phase - 1) + 0.3 * np.sin(2 * phase)
    b = oracles.moments_of_density(slow[:, None], phase, 4)

    found = inverse_fourier(b, window="none", correction="none")

    assert found.density[:, 0] == pytest.approx(slow, abs=1e-12)


@pytest.mark.parametrize("window", ["none", "hann"])
def test_corrections_leave_no_negative_light(window: str) -> None:
    b = oracles.random_moments(np.random.default_rng(3), 4, 50)

    clipped = inverse_fourier(b, window=window, correction="clip")
    lifted = inverse_fourier(b, window=window, correction="lift")

    assert clipped.density.min() >= 0
    assert clipped.cumulative([2 * np.pi])[0] == pytest.approx(b[0].real)
    assert lifted.density.min(axis=0) == pytest.approx(np.zeros(50))


def test_a_sharp_return_becomes_as_wide_as_the_highest_frequency_allows() -> None:
    width = []
    for m in (4, 8, 16):
        density = inverse_fourier(np.exp(3j * np.arange(m + 1)), bins=1024).density
        width.append(np.count_nonzero(density > 0.5 * density.max()) * 2 * np.pi / 1024)
        # the maximum entropy estimate of the same has no such limit
        sharp = tm.density(
            tm.levinson(tm.bias(np.exp(3j * np.arange(m + 1))).moments), grid_rad(1024)
        )
        assert np.count_nonzero(sharp > 0.5 * sharp.max()) * 2 * np.pi / 1024 < width[-1] / 4

    assert np.array(width) * [5, 9, 17] == pytest.approx(2 * np.pi * np.ones(3), rel=0.15)


@pytest.mark.parametrize(
    "arguments", [{"window": "box"}, {"correction": "abs"}, {"bins": 8}], ids=str
)
def test_inverse_fourier_refuses_what_it_does_not_know(arguments: dict[str, object]) -> None:
    with pytest.raises(tm.ParameterError, match=next(iter(arguments))):
        inverse_fourier(np.ones((5, 1)), **arguments)  # type: ignore[arg-type]  # that is the point


# -- orthogonal matching pursuit ------------------------------------------------------------------


@pytest.mark.parametrize("returns", [1, 2, 3])
def test_returns_on_the_grid_are_recovered_from_many_frequencies(returns: int) -> None:
    rng = np.random.default_rng(returns)
    phase, weight = oracles.random_returns(rng, returns=returns, pixels=30, apart_rad=1.2)
    step = 2 * np.pi / 720
    phase, weight = np.round(phase / step) % 720 * step, weight + 0.5
    order = np.argsort(phase, axis=0)
    phase, weight = (np.take_along_axis(each, order, axis=0) for each in (phase, weight))

    found = matching_pursuit(oracles.moments_of_returns(phase, weight, 32), returns=returns)

    exact = oracles.around(found.phase_rad - phase).max(axis=0) < 1e-9
    # side lobes of the others may move the first choice by a bin, which no step takes back
    assert exact.mean() > (0.99 if returns == 1 else 0.5)
    assert found.weight[:, exact] == pytest.approx(weight[:, exact])
    assert oracles.around(found.phase_rad - phase).max() < 5 * step


def test_no_more_returns_are_taken_than_the_moments_ask_for() -> None:
    found = matching_pursuit(np.exp(1j * np.arange(9) * np.pi), returns=4)

    assert np.array_equal(found.weight > 0, [True, False, False, False])


def test_close_returns_are_taken_for_one_between_them() -> None:
    b = oracles.moments_of_returns(np.array([2.0, 2.3]), np.ones(2), 4)

    found = matching_pursuit(b)

    assert np.abs(found.phase_rad - 2.15).min() < 0.02
    assert oracles.around(tm.pisarenko(b).phase_rad[:2] - [2.0, 2.3]).max() < 1e-6


@pytest.mark.parametrize("estimate", [matching_pursuit, frequency_domain])
def test_more_returns_than_moments_are_refused(estimate: object) -> None:
    assert callable(estimate)
    with pytest.raises(tm.ParameterError, match="returns"):
        estimate(np.ones((5, 1)), returns=5)


# -- frequency-domain -----------------------------------------------------------------------------


@pytest.mark.parametrize("m", [16, 32])
def test_returns_farther_apart_than_the_main_lobe_are_found_as_peaks(m: int) -> None:
    rng = np.random.default_rng(m)
    phase, weight = oracles.random_returns(rng, returns=2, pixels=100, apart_rad=8 * np.pi / m)
    weight = weight + 0.5
    # two lobes also around the turn
    apart = phase[1] - phase[0]
    fit = apart < 2 * np.pi - 8 * np.pi / m
    phase, weight = phase[:, fit], weight[:, fit]

    found = frequency_domain(oracles.moments_of_returns(phase, weight, m))

    assert oracles.around(found.phase_rad - phase).max() < 0.5 / m
    assert found.weight == pytest.approx(weight, rel=0.15)


def test_closer_returns_are_one_peak_with_the_papers_few_frequencies() -> None:
    b = oracles.moments_of_returns(np.array([2.0, 2.5]), np.ones(2), 4)

    found = frequency_domain(b)

    assert (found.weight > 0).sum() == 1
    assert found.phase_rad[0] == pytest.approx(2.25, abs=0.01)
    assert oracles.around(tm.pisarenko(b).phase_rad[:2] - [2.0, 2.5]).max() < 1e-6


# -- high-frequency phase -------------------------------------------------------------------------


@pytest.mark.parametrize("m", [2, 5, 32])
def test_a_single_return_is_exact_at_any_phase(m: int) -> None:
    phase = np.linspace(0, 2 * np.pi, 101)[None, :-1]

    found = high_frequency(oracles.moments_of_returns(phase, np.ones((1, 100)), m))

    assert oracles.around(found.phase_rad[0] - phase[0]).max() < 1e-12


def test_smooth_indirect_light_cancels_at_high_frequencies() -> None:
    # as much light as the direct one's comes back with an exponential tail of 1.5 rad
    direct_rad, m = 1.0, 32
    orders = np.arange(m + 1)
    b = np.exp(1j * orders * direct_rad) * (1 + 1 / (1 - 1.5j * orders))

    errors = [
        float(oracles.around(each(b).phase_rad[0] - direct_rad))
        for each in (single_frequency, high_frequency)
    ]

    # what is left has the phase arg(1 + 1 / (1 - 1.5 i m)) / m
    expected = np.angle(1 + 1 / (1 - 1.5j * m)) / m
    assert errors[1] == pytest.approx(expected, rel=1e-6)
    assert errors[1] < 0.01 * errors[0]


def test_a_mirrors_return_does_not_cancel() -> None:
    b = oracles.moments_of_returns(np.array([1.0, 1.8]), np.array([1.0, 0.8]), 32)

    error = float(oracles.around(high_frequency(b).phase_rad[0] - 1.0))

    assert error > 2 * np.pi / 32  # of the wrong period
    assert oracles.around(tm.pisarenko(b).phase_rad[:2] - [1.0, 1.8]).max() < 1e-6


# -- single frequency -----------------------------------------------------------------------------


def test_indirect_light_makes_a_single_frequency_see_too_far() -> None:
    b = oracles.moments_of_returns(np.array([1.0, 2.0]), np.array([1.0, 0.5]), 1)

    found = single_frequency(b)

    assert found.phase_rad[0] == pytest.approx(
        np.arctan2(np.sin(1) + 0.5 * np.sin(2), np.cos(1) + 0.5 * np.cos(2))
    )
    assert found.weight[0] == pytest.approx(np.sqrt(1.25 + np.cos(1)))
