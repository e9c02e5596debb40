"""Normal numbers from a table against the normal distribution."""

import math

import numpy as np

from transientcam_simulation.base import standard_normal


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64(seed))


def test_moments_and_tails_are_those_of_a_normal_variable() -> None:
    count = 4_000_000
    numbers = standard_normal(generator(3), (count,)).astype(np.float64)

    # the variance of the k-th power of a normal variable is (2k - 1)!! - ((k - 1)!!)^2
    for power, expected, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96), (6, 15, 10170)):
        error = 5 * math.sqrt(variance / count)
        assert abs(np.mean(numbers**power) - expected) < error
    for limit in (0.5, 2.0, 4.0, 4.4):
        share = math.erfc(limit / math.sqrt(2))
        beyond = np.mean(np.abs(numbers) > limit)
        assert abs(beyond - share) < 5 * math.sqrt(share / count)


def test_any_shape_is_drawn_and_the_seed_decides() -> None:
    one, other = (standard_normal(generator(7), (11, 13)) for _ in range(2))

    assert one.shape == (11, 13)
    assert (one == other).all()
    assert (one != standard_normal(generator(8), (11, 13))).any()
