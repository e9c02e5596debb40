"""Few returns by weighted least squares: against closed forms, SciPy's solver, laws and chance."""

from typing import Any

import jax
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import least_squares
from scipy.stats import chi2, gamma

import transientcam_moments as tm
from tests.moments.oracles import moments_of_returns
from transientcam_moments.likelihood import _chi_square as chi_square, choice, sharp, tail

NOISE_SHARE = 1 / 100


def moments_of_tail(
    phase_rad: Any, weight: Any, tail: Any, delay_rad: Any, m: int, shape: int = 3
) -> np.ndarray:
    j = np.arange(m + 1)[:, None]
    late = 1 / (1 - 1j * j * np.asarray(delay_rad) / shape) ** shape
    b: np.ndarray = np.exp(1j * j * phase_rad) * (weight + tail * late)
    return b


def equal_noise(b: np.ndarray, std: float) -> tm.noise.MomentNoise:
    return tm.noise.MomentNoise(np.full(b.shape, std**2))


def noisy(b: np.ndarray, noise: tm.noise.MomentNoise, seed: int = 0) -> np.ndarray:
    drawn: np.ndarray = tm.noise.draw(b, noise, np.random.default_rng(seed), draws=1)[:, 0]
    return drawn


def spread_returns(count: int, pixels: int, *, apart: float, seed: int = 0) -> Any:
    """Return phases and weights (K, P) of returns that are well apart, of similar strength."""
    random = np.random.default_rng(seed)
    phase = 0.6 + np.cumsum(apart + random.uniform(0, 0.2, (count, pixels)), axis=0)
    return phase, random.uniform(0.5, 1.0, (count, pixels))


# -- closed forms -----------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 3])
def test_returns_without_noise_are_found_as_they_are(count: int) -> None:
    phase, weight = spread_returns(count, 200, apart=1.1)
    b = moments_of_returns(phase, weight, 4)

    found = tm.likelihood(b, equal_noise(b, 1e-3))

    assert (found.count == count).all()
    assert np.abs(found.phase_rad[:count] - phase).max() < 2e-5
    assert np.abs(found.weight[:count] - weight).max() < 2e-5
    assert np.isnan(found.phase_rad[count:]).all()
    assert (found.weight[count:] == 0).all()
    assert not found.has_tail.any()


def test_a_tail_without_noise_is_found_as_it_is() -> None:
    random = np.random.default_rng(0)
    phase, weight, light = random.uniform(0.5, 4, 100), random.uniform(0.4, 1, 100), 1.0
    b = moments_of_tail(phase, weight, light, 0.75, 4)

    found = tm.likelihood(b, equal_noise(b, 1e-3))

    assert found.has_tail.mean() > 0.97
    there = found.has_tail
    assert np.abs(found.phase_rad[0] - phase)[there].max() < 1e-3
    assert np.abs(found.weight[0] - weight)[there].max() < 5e-3
    assert np.abs(found.tail - light)[there].max() < 5e-3
    assert np.abs(found.delay_rad - 0.75)[there].max() < 5e-3


def test_deviations_of_one_return_are_those_of_the_closed_form() -> None:
    b = moments_of_returns([[1.0, 2.0]], [[3.0, 5.0]], 4)
    variance = np.array([0.04, 0.01, 0.02, 0.03, 0.05])

    found = tm.likelihood(b, tm.noise.MomentNoise(variance))

    j = np.arange(1, 5)
    information = (j**2 / variance[1:]).sum() * np.array([3.0, 5.0]) ** 2
    assert found.phase_std_rad[0] == pytest.approx(1 / np.sqrt(information))
    assert found.weight_std[0] == pytest.approx(np.full(2, 1 / np.sqrt((1 / variance).sum())))


def test_deviations_of_returns_are_the_cramer_rao_bound() -> None:
    phase, weight = spread_returns(3, 50, apart=1.1)
    b = moments_of_returns(phase, weight, 4)
    noise = equal_noise(b, 1e-3)
    noise.variance[0] = 0  # the bound is without b_0

    found = tm.likelihood(b, noise)

    bound = tm.noise.cramer_rao(phase, weight, noise)
    assert np.allclose(found.phase_std_rad, bound.phase_std_rad, rtol=1e-3)
    assert np.allclose(found.weight_std, bound.weight_std, rtol=1e-3)


@pytest.mark.parametrize("free", [1, 2, 3, 6, 9, 64])
@pytest.mark.parametrize("significance", [0.3, 1e-3, 1e-9])
def test_quantiles_of_chi_square_are_scipys(free: int, significance: float) -> None:
    found = chi_square.chi_square_quantile(free, significance)

    assert found == pytest.approx(chi2.isf(significance, free), rel=1e-9)


# -- an independent solver --------------------------------------------------------------------


def scipys_chi_square(b: np.ndarray, std: float, start: np.ndarray) -> float:
    """Return the least sum of squares that SciPy reaches from phases and weights on."""
    m, count = len(b) - 1, len(start) // 2

    def left(unknowns: np.ndarray) -> np.ndarray:
        model = moments_of_returns(unknowns[:count, None], unknowns[count:, None], m)[:, 0]
        rest = (b - model) / std
        return np.concatenate([rest.real, rest.imag[1:]])

    bounds = (np.r_[np.full(count, -9.0), np.zeros(count)], np.full(2 * count, 20.0))
    return float(2 * least_squares(left, start, bounds=bounds, xtol=1e-12, ftol=1e-12).cost)


@pytest.mark.parametrize("count", [2, 3])
def test_scipy_finds_no_better_returns_from_the_truth(count: int) -> None:
    phase, weight = spread_returns(count, 24, apart=1.0)
    b = moments_of_returns(phase, weight, 4)
    noise = equal_noise(b, NOISE_SHARE)
    measured = noisy(b, noise)

    found = tm.likelihood(measured, noise, tail_shape=0)

    assert (found.count == count).mean() > 0.9
    for pixel in np.flatnonzero(found.count == count):
        start = np.concatenate([phase[:, pixel], weight[:, pixel]])
        theirs = scipys_chi_square(measured[:, pixel], NOISE_SHARE, start)
        assert found.chi_square[pixel] == pytest.approx(theirs, abs=0.02)


def test_scipy_finds_no_better_tail_from_the_truth() -> None:
    m = 4
    b = moments_of_tail(np.linspace(1, 3, 24), 0.7, 1.0, 0.8, m)
    noise = equal_noise(b, NOISE_SHARE)
    measured = noisy(b, noise)

    found = tm.likelihood(measured, noise, returns=1)

    assert found.has_tail.all()
    for pixel in range(24):

        def left(unknowns: np.ndarray, pixel: int = pixel) -> np.ndarray:
            phase, weight, light, change = unknowns
            model = moments_of_tail(phase, weight, light, 0.75 * np.exp(change), m)[:, 0]
            rest = (measured[:, pixel] - model) / NOISE_SHARE
            return np.concatenate([rest.real, rest.imag[1:], [change]])

        start = [np.linspace(1, 3, 24)[pixel], 0.7, 1.0, np.log(0.8 / 0.75)]
        bounds = ([-9, 0, 0, -3], [9, 9, 9, 2])
        theirs = least_squares(left, start, bounds=bounds, xtol=1e-12, ftol=1e-12)
        assert found.phase_rad[0, pixel] == pytest.approx(theirs.x[0], abs=2e-3)
        assert found.delay_rad[pixel] == pytest.approx(0.75 * np.exp(theirs.x[3]), rel=2e-2)


# -- chance -----------------------------------------------------------------------------------


def test_chi_square_of_noise_is_its_degrees_of_freedom() -> None:
    b = moments_of_returns(np.full((1, 4000), 2.0), 1.0, 4)
    noise = equal_noise(b, NOISE_SHARE)

    found = tm.likelihood(noisy(b, noise), noise)

    assert (found.degrees_of_freedom[found.count == 1] == 7).all()
    assert found.chi_square.mean() == pytest.approx(7, abs=0.2)
    assert found.chi_square.var() == pytest.approx(14, rel=0.12)
    assert np.nanmean(found.reduced_chi_square) == pytest.approx(1, abs=0.03)
    assert found.explained(0.1).mean() == pytest.approx(0.9, abs=0.02)
    assert found.explained().mean() > 0.995


@pytest.mark.parametrize("m", [3, 8])
@pytest.mark.parametrize("with_zeroth", [True, False])
def test_one_return_is_split_in_fewer_than_one_of_a_thousand(m: int, with_zeroth: bool) -> None:
    b = moments_of_returns(np.full((1, 8000), 2.0), 1.0, m)
    noise = equal_noise(b, NOISE_SHARE)
    if not with_zeroth:
        noise.variance[0] = 0

    found = tm.likelihood(noisy(b, noise), noise)

    assert ((found.count > 1) | found.has_tail).mean() < 1.5e-3  # 1e-3 in the long run


def test_errors_are_as_large_as_the_deviations_say() -> None:
    phase, weight = spread_returns(2, 3000, apart=1.4)
    b = moments_of_returns(phase, weight, 4)
    noise = equal_noise(b, NOISE_SHARE)

    found = tm.likelihood(noisy(b, noise), noise)

    two = found.count == 2
    assert two.mean() > 0.99
    for mine, std, true in (
        (found.phase_rad, found.phase_std_rad, phase),
        (found.weight, found.weight_std, weight),
    ):
        errors = ((mine[:2] - true) / std[:2])[:, two]
        assert errors.std() == pytest.approx(1, abs=0.05)


def test_a_response_of_no_model_is_not_explained() -> None:
    # a ring of five equal returns a fifth of a turn apart has no moments but b_5
    phase = 2 * np.pi * np.arange(5)[:, None] / 5 + np.linspace(0.1, 1, 30)
    b = moments_of_returns(phase, 1.0, 6)
    noise = equal_noise(b, NOISE_SHARE)

    found = tm.likelihood(noisy(b, noise), noise)

    assert not found.explained().any()
    assert (found.chi_square > 1000).all()


# -- laws -------------------------------------------------------------------------------------


def some_moments(m: int = 4, pixels: int = 60, seed: int = 3) -> np.ndarray:
    """Return noisy moments of one, two and three returns, of tails and of no model."""
    random = np.random.default_rng(seed)
    phase = random.uniform(0, 2 * np.pi, (5, pixels))
    weight = random.uniform(0, 1, (5, pixels)) * (np.arange(5)[:, None] <= np.arange(pixels) % 5)
    b = moments_of_returns(phase, weight, m)
    b[:, ::6] = moments_of_tail(phase[0], 0.5, 0.8, 0.6, m)[:, ::6]
    b += 0.01 * (random.standard_normal(b.shape) + 1j * random.standard_normal(b.shape))
    b[0].imag = 0
    return b


@settings(deadline=None, max_examples=25)
@given(turn=st.floats(-6, 6), seed=st.integers(0, 50))
def test_a_later_scene_has_later_returns_and_nothing_else_changes(turn: float, seed: int) -> None:
    b = some_moments(seed=seed, pixels=20)
    noise = equal_noise(b, 0.01)
    later = b * np.exp(1j * np.arange(len(b)) * turn)[:, None]

    before, after = tm.likelihood(b, noise), tm.likelihood(later, noise)

    # starts are on a grid of phases: where several optima are about as good another one may win
    same = np.isclose(before.chi_square, after.chi_square, rtol=1e-3, atol=1e-3)
    assert same.mean() > 0.6
    assert (before.count == after.count)[same].mean() > 0.9
    same &= before.count == after.count
    total = (before.weight.sum(axis=0) - after.weight.sum(axis=0))[same]
    assert np.abs(total).max(initial=0) < 0.2
    point = (before.weight * np.exp(1j * np.nan_to_num(before.phase_rad))).sum(axis=0)
    turned = (after.weight * np.exp(1j * np.nan_to_num(after.phase_rad))).sum(axis=0)
    assert np.abs(point * np.exp(1j * turn) - turned)[same].max(initial=0) < 0.2


@settings(deadline=None, max_examples=25)
@given(factor=st.floats(1e-6, 1e6))
def test_a_brighter_scene_with_as_much_more_noise_has_the_same_returns(factor: float) -> None:
    b = some_moments()
    before = tm.likelihood(b, equal_noise(b, 0.01))

    after = tm.likelihood(factor * b, equal_noise(b, factor * 0.01))

    assert np.allclose(after.phase_rad, before.phase_rad, atol=1e-6, equal_nan=True)
    assert np.allclose(after.weight / factor, before.weight, atol=1e-6)
    assert np.allclose(after.chi_square, before.chi_square, rtol=1e-5, atol=1e-5, equal_nan=True)
    assert np.allclose(after.weight_std / factor, before.weight_std, rtol=1e-4, equal_nan=True)


def test_models_count_by_their_scores_also_around_the_turn() -> None:
    random = np.random.default_rng(4)
    phase = np.remainder(random.normal(0, 0.2, (4, 500)), 2 * np.pi)
    square, score = random.uniform(0.01, 0.2, (2, 4, 500))
    score *= 100
    found: list[Any] = [np.zeros(500)] * choice.PLANES
    choice.nothing(phase[0], np.full(500, np.inf), found)

    for each in zip(phase, square, score, strict=True):
        choice.join(*each, np.full(500, fill_value=True), found)

    weight = np.exp(-(score - score.min(axis=0)) / 2)
    weight /= weight.sum(axis=0)
    off = np.remainder(phase + np.pi, 2 * np.pi) - np.pi
    mean = (weight * off).sum(axis=0)
    variance = (weight * (square + (off - mean) ** 2)).sum(axis=0)
    around = np.remainder(found[choice.MEAN] - mean + np.pi, 2 * np.pi) - np.pi
    assert np.abs(around).max() < 1e-5
    assert found[choice.SPREAD] == pytest.approx(variance, abs=1e-5)


def test_the_average_is_that_of_the_threshold_and_others_are_of_the_chosen_model() -> None:
    b = some_moments(pixels=200)
    noise = equal_noise(b, 0.01)
    found = tm.likelihood(b, noise, threshold=0.4)

    assert np.array_equal(found.separate().phase_rad, found.average_rad, equal_nan=True)
    assert np.array_equal(found.direct_phase_std_rad(0.4), found.average_std_rad, equal_nan=True)
    chosen, by_default = found.separate(0.1), tm.likelihood(b, noise).separate(0.1)
    lone = (found.count == 1) & ~found.has_tail
    assert np.isin(chosen.phase_rad, found.phase_rad).all()
    assert np.allclose(chosen.phase_rad[lone], by_default.phase_rad[lone], atol=1e-2)
    assert not np.allclose(found.average_rad, by_default.phase_rad)


def test_moments_of_no_model_have_a_deviation_as_large_as_their_misfit() -> None:
    b = some_moments(pixels=400)
    found = tm.likelihood(b, equal_noise(b, 1e-4), returns=1, tail_shape=0)

    misfit = np.sqrt(found.chi_square / (2 * len(b) - 1))
    assert (misfit > 10).mean() > 0.5
    assert found.average_std_rad == pytest.approx(
        found.phase_std_rad[0] * np.maximum(misfit, 1), rel=1e-4
    )


@pytest.mark.parametrize("m", [1, 2, 5, 8])
def test_starts_are_tried_at_phases_all_around_the_turn(m: int) -> None:
    turns = choice.turns_of(m)
    series = np.random.default_rng(m).normal(size=(2, m + 1, 1))
    tried = []
    for row, t in enumerate(2 * np.pi * np.arange(m + 2) / (4 * m + 6)):
        sums = sharp.four_sums((0,) * m, turns, row, 0, series[0], series[1])
        for phase, found in zip((t, -t, np.pi - t, np.pi + t), sums, strict=True):
            angle = np.arange(1, m + 1) * phase
            waves = np.cos(angle) @ series[0, 1:] + np.sin(angle) @ series[1, 1:]
            assert np.allclose(found, series[0, 0] + waves)
            tried.append(round(phase / (2 * np.pi) * (4 * m + 6)) % (4 * m + 6))
    assert set(tried) == set(range(4 * m + 6))


def test_no_step_raises_chi_square(monkeypatch: pytest.MonkeyPatch) -> None:
    costs: list[tuple[np.ndarray, np.ndarray]] = []

    def watched(step: Any, before: int) -> Any:
        def run(*arguments: Any) -> Any:
            result = step(*arguments)
            costs.append((arguments[before], result[-2]))
            return result

        return run

    monkeypatch.setattr(sharp, "step", watched(sharp.step, 11))
    monkeypatch.setattr(tail, "step", watched(tail.step, 19))
    b = some_moments(pixels=300)

    tm.likelihood(b, equal_noise(b, 0.003))

    # more than the first fits of all models take: others begin anew
    assert len(costs) > sum(choice.STEPS) + choice.TAIL_STEPS + choice.LATE_STEPS
    assert all((after <= before).all() for before, after in costs)


def test_more_models_never_have_a_worse_score() -> None:
    b = some_moments(pixels=300)
    noise = equal_noise(b, 0.003)
    penalty = np.log(9) + choice.MARGIN

    def score(found: tm.Likelihood) -> np.ndarray:
        unknowns = 9 - found.degrees_of_freedom
        value: np.ndarray = found.chi_square + penalty * unknowns
        return value

    one = tm.likelihood(b, noise, returns=1, tail_shape=0)
    two = tm.likelihood(b, noise, returns=2, tail_shape=0)
    three = tm.likelihood(b, noise, returns=3, tail_shape=0)

    assert (score(two) <= score(one) + 1e-9).all()
    assert (score(three) <= score(two) + 1e-9).all()


def test_wax_is_not_later_than_its_deviation_says() -> None:
    random = np.random.default_rng(3)
    phase, delay = random.uniform(1, 3, 300), random.uniform(0.1, 0.4, 300)
    j = np.arange(5)[:, None]
    b = np.exp(1j * j * phase) / (1 - 1j * j * delay)  # an exponential decay, no return
    noise = equal_noise(b, 1 / 300)

    found = tm.likelihood(tm.noise.draw(b, noise, random, draws=1)[:, 0], noise)

    off = np.angle(np.exp(1j * (found.average_rad - phase)))
    assert np.mean(np.abs(off) > 3 * found.average_std_rad) < 0.06
    assert np.median(np.abs(off)) < 0.2 * np.median(delay)


# -- what is measured -------------------------------------------------------------------------


def test_b_0_need_not_be_measured() -> None:
    phase, weight = spread_returns(2, 50, apart=1.2)
    b = moments_of_returns(phase, weight, 3)
    b[0] = np.nan
    noise = equal_noise(b, 1e-3)
    noise.variance[0] = 0

    found = tm.likelihood(b, noise)

    assert (found.count == 2).all()
    assert np.abs(found.phase_rad[:2] - phase).max() < 1e-4
    assert (found.degrees_of_freedom == 2).all()


def test_harmonics_may_have_gaps_and_any_order() -> None:
    phase, weight = spread_returns(2, 50, apart=1.2)
    places = (5, 1, 2, 4)
    b = moments_of_returns(phase, weight, 5)[list(places)]

    found = tm.likelihood(b, equal_noise(b, 1e-3), harmonics=places)

    assert (found.count == 2).all()
    assert np.abs(found.phase_rad[:2] - phase).max() < 1e-4
    assert (found.degrees_of_freedom == 4).all()


def test_a_moment_without_information_may_be_anything() -> None:
    phase, weight = spread_returns(1, 4, apart=1.0)
    b = moments_of_returns(phase, weight, 4)
    noise = equal_noise(b, 1e-3)
    for place, (value, variance) in enumerate([(1e30, np.inf), (np.nan, np.nan), (np.inf, 0)]):
        b[2, place], noise.variance[2, place] = value, variance

    found = tm.likelihood(b, noise)

    assert (found.count == 1).all()
    assert np.abs(found.phase_rad[0] - phase[0]).max() < 1e-4
    assert found.degrees_of_freedom.tolist() == [5, 5, 5, 7]


def test_a_moment_weighs_as_much_as_it_is_certain() -> None:
    b = moments_of_returns([[1.0, 1.0]], [[1.0, 1.0]], 2)
    b[2] = np.exp(2.3j)  # says 1.15 radian
    noise = tm.noise.MomentNoise(np.array([[1e-4, 1e-4], [1e-4, 1e-4], [1e-2, 1e2]]))

    found = tm.likelihood(b, noise, returns=1, tail_shape=0)

    # to first order the mean of 1 and 1.15 with weights j^2 / variance
    assert found.phase_rad[0] == pytest.approx([1 + 0.15 * 400 / 10400, 1.0], abs=1e-3)


@pytest.mark.parametrize("m", [1, 2, 3])
def test_few_moments_have_few_unknowns(m: int) -> None:
    b = some_moments(m)
    noise = equal_noise(b, 0.01)
    noise.variance[0] = 0

    found = tm.likelihood(b, noise)

    assert (found.degrees_of_freedom >= 0).all()
    assert (found.count <= m).all()
    assert m > 1 or not found.has_tail.any()
    assert found.phase_rad.shape == (min(3, m), 60)
    assert found.explained()[found.degrees_of_freedom == 0].all()


# -- odd pixels -------------------------------------------------------------------------------

ODD = (0, -1, np.nan, np.inf, -np.inf, 1e308, 5e-324, 1e-300)


@pytest.mark.parametrize("precision", [np.complex64, np.complex128])
def test_odd_pixels_have_no_return_and_leave_their_neighbours_alone(precision: type) -> None:
    b: np.ndarray = some_moments().astype(precision)
    noise = equal_noise(b, 0.01)
    clean = tm.likelihood(b, noise)
    odd = b.copy()
    with np.errstate(over="ignore"):
        for place, value in enumerate(ODD):
            odd[:, 3 * place] = value
    odd[2, 40] = np.nan

    found = tm.likelihood(odd, noise)

    normal = np.ones(60, bool)
    normal[[*(3 * place for place in range(len(ODD))), 40]] = False
    for mine, theirs in zip(found[:-1], clean[:-1], strict=True):
        assert np.array_equal(mine[..., normal], theirs[..., normal], equal_nan=True)
    dark = [0, 3, 6, 9, 12, 40]
    assert (found.count[dark] == 0).all()
    assert np.isnan(found.phase_rad[:, dark]).all()
    assert (found.weight[:, dark] == 0).all()
    assert not found.explained()[dark].any()
    there = found.count > 0
    assert np.isfinite(found.phase_rad[0, there]).all()
    assert np.isfinite(found.weight[:, there]).all()
    assert np.isfinite(found.chi_square[there]).all()


def test_single_precision_finds_what_double_finds() -> None:
    b = some_moments(pixels=400)
    noise = equal_noise(b, 0.01)

    double, single = tm.likelihood(b, noise), tm.likelihood(b.astype(np.complex64), noise)

    same = double.count == single.count
    assert same.mean() > 0.99
    assert {part.dtype for part in single[:9]} == {np.dtype(np.float32)}
    close = np.isclose(double.chi_square, single.chi_square, rtol=1e-2, atol=1e-2)
    assert close.mean() > 0.98
    same &= close
    assert np.nanquantile(np.abs(double.phase_rad - single.phase_rad)[:, same], 0.99) < 1e-3


def test_exact_moments_count_as_exact_to_rounding() -> None:
    b = moments_of_returns([[1.0], [2.5]], [[1.0], [0.6]], 4)

    found = tm.likelihood(b, equal_noise(b, 1e-100))

    assert found.phase_rad[:2, 0] == pytest.approx([1.0, 2.5])
    assert np.isfinite(found.chi_square).all()


# -- arrays -----------------------------------------------------------------------------------


def test_jax_compiles_it_and_gives_what_numpy_gives() -> None:
    def run(b: Any, variance: Any) -> Any:
        return tm.likelihood(b, tm.noise.MomentNoise(variance))[:-1]

    b = some_moments(m=1, pixels=20)  # of higher orders compiling takes half a minute
    b[:, 3] = np.nan
    expected = run(b, np.full(b.shape, 1e-4))
    with jax.enable_x64(True):
        arguments = jax.numpy.asarray(b), jax.numpy.full(b.shape, 1e-4)
        found = jax.jit(run)(*arguments)
        more = jax.numpy.asarray(some_moments(m=3, pixels=20))
        shapes = jax.eval_shape(run, more, jax.numpy.full(more.shape, 1e-4))

    for mine, theirs in zip(map(np.asarray, found), expected, strict=True):
        assert mine.shape == theirs.shape
        assert mine.dtype == theirs.dtype
        assert np.allclose(mine, theirs, rtol=1e-6, atol=1e-6, equal_nan=True)
    assert [part.shape for part in shapes[:5]] == [(3, 20)] * 4 + [(20,)]


def test_pixels_may_have_any_axes_and_none() -> None:
    b = some_moments(pixels=60)
    flat = tm.likelihood(b, equal_noise(b, 0.01))

    image = tm.likelihood(b.reshape(5, 6, 10), equal_noise(b.reshape(5, 6, 10), 0.01))
    alone = tm.likelihood(b[:, 7], tm.noise.MomentNoise(np.full(5, 1e-4)))
    none = tm.likelihood(b[:, :0], equal_noise(b[:, :0], 0.01))

    assert np.array_equal(image.weight.reshape(3, -1), flat.weight)
    assert np.array_equal(alone.weight, flat.weight[:, 7])
    assert none.phase_rad.shape == (3, 0)


def test_without_noise_a_share_of_the_light_is_assumed() -> None:
    b = some_moments()
    size = np.abs(b.view(float).reshape(5, -1, 2)).max(axis=(0, 2))

    assumed = tm.likelihood(b)

    std = np.broadcast_to(tm.noise.ASSUMED_NOISE * size, b.shape)
    stated = tm.likelihood(b, tm.noise.MomentNoise(std**2))
    assert np.array_equal(assumed.chi_square, stated.chi_square, equal_nan=True)


# -- direct and indirect ----------------------------------------------------------------------


def test_light_of_the_tail_is_indirect_and_its_return_the_direct_one() -> None:
    b = moments_of_tail(np.full(1, 1.0), 0.05, 1.0, 0.8, 6)

    found = tm.likelihood(b, equal_noise(b, 1e-3))
    direct, indirect, phase = found.separate()

    assert found.has_tail.all()
    assert phase == pytest.approx(1.0, abs=0.01)
    assert direct == pytest.approx(0.05, abs=0.01)
    assert indirect == pytest.approx(1.0, abs=0.01)
    assert found.direct_phase_std_rad() == pytest.approx(found.phase_std_rad[0])


def test_a_return_below_the_threshold_is_not_the_direct_one() -> None:
    b = moments_of_returns([[1.0], [3.0]], [[0.2], [1.0]], 4)
    found = tm.likelihood(b, equal_noise(b, 1e-3))

    low, high = found.separate(0.1), found.separate(0.3)

    assert low.phase_rad == pytest.approx(1.0, abs=1e-3)
    assert high.phase_rad == pytest.approx(3.0, abs=1e-3)
    assert high.indirect == pytest.approx(0.2, abs=1e-3)
    assert found.direct_phase_std_rad(0.3) == pytest.approx(found.phase_std_rad[1])


# -- arguments --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"returns": 0}, "returns"),
        ({"returns": 4}, "returns"),
        ({"tail_shape": -1}, "tail_shape"),
        ({"tail_shape": 7}, "tail_shape"),
        ({"harmonics": (0, 1, 1)}, "harmonics"),
        ({"harmonics": (-1, 1, 2)}, "harmonics"),
        ({"harmonics": (0, 1, 33)}, "harmonics"),
    ],
)
def test_wrong_arguments_are_named(options: dict[str, Any], field: str) -> None:
    with pytest.raises(tm.ParameterError, match=field):
        tm.likelihood(np.ones((3, 2), complex), **options)


def test_noise_and_harmonics_have_to_fit_the_moments() -> None:
    b = np.ones((3, 2), complex)

    with pytest.raises(tm.ShapeError, match="noise"):
        tm.likelihood(b, tm.noise.MomentNoise(np.ones((2, 2))))
    with pytest.raises(tm.ShapeError, match="harmonics"):
        tm.likelihood(b, harmonics=(0, 1))


def test_a_model_error_counts_as_noise_of_the_largest_moment() -> None:
    random = np.random.default_rng(8)
    b = 700 * moments_of_returns(random.uniform(1, 5, (2, 50)), np.full((2, 50), 0.5), 4)
    noise = tm.noise.MomentNoise(np.full(b.shape, 3.0**2))
    drawn = tm.noise.draw(b, noise, random, draws=1)[:, 0]

    found = tm.likelihood(drawn, noise, model_error=0.01)

    largest = np.maximum(abs(drawn.real), abs(drawn.imag)).max(axis=0)
    both = tm.noise.MomentNoise(noise.variance + (0.01 * largest) ** 2)
    for mine, theirs in zip(found[:-1], tm.likelihood(drawn, both)[:-1], strict=True):
        assert np.allclose(mine, theirs, rtol=1e-6, equal_nan=True)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"model_error": -0.1}, "model_error"),
        ({"model_error": 1.5}, "model_error"),
        ({"threads": 0}, "threads"),
    ],
)
def test_model_error_and_threads_are_checked(options: dict[str, Any], field: str) -> None:
    with pytest.raises(tm.ParameterError, match=field):
        tm.likelihood(np.ones((4, 5), complex), **options)


@pytest.mark.parametrize("significance", [0.0, 1.0, -1.0, np.nan])
def test_significance_is_a_probability(significance: float) -> None:
    found = tm.likelihood(np.ones((3, 2), complex))

    with pytest.raises(tm.ParameterError, match="significance"):
        found.explained(significance)


def test_the_light_of_a_tail_comes_as_a_gamma_distribution_does_turn_after_turn() -> None:
    b = moments_of_tail(np.full(1, 4.0), 0.5, 1.0, 1.2, 6)
    phases = np.array([0.5, 3.9, 4.1, 5.0, 6.2, 2 * np.pi])

    found = tm.comparisons.TECHNIQUES["likelihood"].estimate(b).cumulative(phases)[:, 0]

    turns = 2 * np.pi * np.arange(12)[:, None]
    tail = gamma(3, scale=0.4)
    late = (tail.cdf(phases + turns - 4) - tail.cdf(turns - 4)).sum(axis=0)
    assert found == pytest.approx(0.5 * (phases >= 4) + late, abs=0.01)
