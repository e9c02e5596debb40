"""Returns that noise split are merged, and no others."""

import numpy as np
import pytest

import transientcam_moments as tm
from tests.moments.oracles import moments_of_returns

STD = 0.005


def noisy(phase: np.ndarray, weight: np.ndarray, m: int) -> tuple[np.ndarray, tm.noise.MomentNoise]:
    """Return moments (m + 1, P) of returns (K, P) with noise, and that noise."""
    b = moments_of_returns(phase, weight, m)
    noise = tm.noise.MomentNoise(np.full(b.shape, STD**2))
    return tm.noise.draw(b, noise, np.random.default_rng(m), draws=1)[:, 0], noise


@pytest.mark.parametrize("m", [3, 4])
def test_a_return_that_noise_split_is_one_again(m: int) -> None:
    phase = np.random.default_rng(1).uniform(0, 2 * np.pi, (1, 2000))
    b, noise = noisy(phase, np.ones((1, 2000)), m)
    split = tm.pisarenko(b)

    merged = tm.merge_returns(split, noise)

    def off(returns: tm.Returns) -> np.ndarray:
        found = tm.separate(returns).phase_rad
        around: np.ndarray = np.remainder(found - phase[0] + np.pi, 2 * np.pi) - np.pi
        return around

    strong = merged.weight > 0.1 * merged.weight.max(axis=0)
    assert (strong.sum(axis=0) == 1).mean() > 0.998
    assert np.sqrt(np.mean(off(merged) ** 2)) < np.sqrt(np.mean(off(split) ** 2)) / 4
    light = merged.weight.sum(axis=0) + merged.uniform
    assert light == pytest.approx(split.weight.sum(axis=0) + split.uniform)


def test_returns_that_noise_cannot_have_split_stay() -> None:
    phase = np.array([[1.0], [2.5], [4.2]]) + np.random.default_rng(2).uniform(0, 0.5, (1, 500))
    b, noise = noisy(phase, np.full((3, 500), 1 / 3), 4)

    merged = tm.merge_returns(tm.pisarenko(b), noise)

    # what noise leaves of a fourth one may be between two of them
    strong = merged.weight > 0.1
    assert (strong.sum(axis=0) == 3).mean() > 0.98


def test_neighbours_are_merged_around_the_turn() -> None:
    returns = tm.Returns(
        np.array([0.01, 3.0, 2 * np.pi - 0.03]),
        np.array([0.3, 0.5, 0.1]),
        np.array(0.0),
        np.array(3),
    )

    merged = tm.merge_returns(returns, tm.noise.MomentNoise(np.full(4, STD**2)))

    assert int(merged.count) == 2
    # 0.3 at 0.01 and 0.1 at -0.03 have mean 0, which may come out as nearly a whole turn
    by_place = np.argsort(-np.cos(merged.phase_rad[:2]))
    assert np.cos(merged.phase_rad[by_place]) == pytest.approx([1.0, np.cos(3.0)], abs=1e-4)
    assert merged.weight[by_place] == pytest.approx([0.4, 0.5], rel=1e-3)
    assert np.isnan(merged.phase_rad[2])


def test_pixels_without_returns_stay_without_and_moments_not_measured_say_nothing() -> None:
    b = np.zeros((4, 3), complex)
    b[:, 1] = np.nan
    b[:, 2] = np.exp(1j * np.arange(4))
    empty = tm.merge_returns(tm.pisarenko(b), tm.noise.MomentNoise(np.full(4, STD**2)))

    assert empty.count.tolist() == [0, 0, 1]
    assert np.isnan(empty.phase_rad[:, :2]).all()
    # nothing was measured, so nothing says that two are one
    split = tm.Returns(np.array([1.0, 3.0]), np.array([0.5, 0.5]), np.array(0.0), np.array(2))
    assert int(tm.merge_returns(split, tm.noise.MomentNoise(np.zeros(3))).count) == 2


def test_noise_has_to_fit_the_returns() -> None:
    returns = tm.pisarenko(np.ones((4, 5), complex))

    with pytest.raises(tm.ShapeError, match="noise"):
        tm.merge_returns(returns, tm.noise.MomentNoise(np.ones((3, 5))))


def test_without_noise_a_hundredth_of_the_light_is_assumed() -> None:
    rng = np.random.default_rng(4)
    apart = rng.uniform(0.01, 0.6, 400)
    phase = np.stack([np.full(400, 2.0), 2.0 + apart, np.full(400, 4.5)])
    b = moments_of_returns(phase, np.array([[3.0], [2.0], [1.0]]) * np.ones((3, 400)), 3)
    returns = tm.pisarenko(b)
    light = returns.weight.sum(axis=0) + np.maximum(returns.uniform, 0)
    noise = tm.noise.MomentNoise(np.broadcast_to((0.01 * light) ** 2, b.shape))

    assumed, stated = tm.merge_returns(returns), tm.merge_returns(returns, noise)

    np.testing.assert_array_equal(assumed.count, stated.count)
    assert 0.1 < (assumed.count == 2).mean() < 0.9
