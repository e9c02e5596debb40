"""The likelihood reaches the least chi-square of its models, and says how far off its range is."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

import transientcam_moments as tm

Array = NDArray[Any]


def moments(phase: Array, weight: Array, m: int) -> Array:
    j = np.arange(m + 1)[:, None, None]
    b: Array = (weight * np.exp(1j * j * phase)).sum(axis=1)
    return b


def noisy(b: Array, std: float, seed: int) -> tuple[Array, tm.noise.MomentNoise]:
    random = np.random.default_rng(seed)
    drawn = b + std * (random.normal(size=b.shape) + 1j * random.normal(size=b.shape))
    drawn[0] = drawn[0].real
    return drawn, tm.noise.MomentNoise(np.full(b.shape, std**2))


def least_chi_square(b: Array, std: float, truth: Array, count: int) -> float:
    """Least chi-square of one pixel by SciPy's solver, from the truth and one other start."""
    random = np.random.default_rng(0)
    j = np.arange(len(b))[:, None]

    def left(unknowns: Array) -> Array:
        rest = (b - np.exp(1j * j * unknowns[:count]) @ unknowns[count:]) / std
        return np.concatenate([rest.real, rest.imag[1:]])

    def slopes(unknowns: Array) -> Array:
        waves = np.exp(1j * j * unknowns[:count])
        slope = -np.concatenate([1j * j * waves * unknowns[count:], waves], axis=1) / std
        return np.concatenate([slope.real, slope.imag[1:]])

    bounds = (np.r_[np.full(count, -9.0), np.zeros(count)], np.full(2 * count, 20.0))
    starts = [truth, truth * random.uniform(0.7, 1.4, 2 * count)]
    jac: Any = slopes  # SciPy's stubs know names of methods alone
    return float(min(2 * least_squares(left, each, jac, bounds).cost for each in starts))


@pytest.mark.parametrize("std", [3.5e-2, 3.5e-3, 7e-4, 1.4e-4])
@pytest.mark.parametrize(
    ("m", "apart", "weights"),
    [
        (2, (0.3,), (0.5, 0.5)),
        (3, (0.2,), (0.5, 0.5)),
        (4, (0.5,), (0.1, 0.9)),
        (8, (0.125,), (0.75, 0.25)),
        (3, (0.77, 1.54), (0.6, 0.25, 0.15)),
        (3, (0.39, 1.93), (0.6, 0.25, 0.15)),
        (4, (0.39, 1.93), (0.6, 0.25, 0.15)),
    ],
)
def test_no_returns_explain_better_than_those_that_are_found(
    m: int, apart: tuple[float, ...], weights: tuple[float, ...], std: float
) -> None:
    pixels, count = 6, len(weights)
    first = np.random.default_rng(m).uniform(0.3, 2, pixels)
    phase = first + np.array([0, *apart])[:, None]
    weight = np.repeat(np.array(weights)[:, None], pixels, axis=1)
    b, noise = noisy(moments(phase, weight, m), std, seed=count)

    found = tm.likelihood(b, noise)

    truth = np.concatenate([phase, weight])
    least = [least_chi_square(b[:, p], std, truth[:, p], count) for p in range(pixels)]
    # the price of an unknown, as `likelihood` documents it: fewer returns or a tail may be better
    price = np.log(2 * m + 1) + 6
    unknowns = np.where(found.has_tail, 4, 2 * found.count)
    assert (found.chi_square + price * unknowns <= np.array(least) + price * 2 * count + 1).all()
    full = (found.count == count) & ~found.has_tail
    assert (found.chi_square[full] <= np.array(least)[full] + 1).all()
    assert full.any() or std > 1e-3


def tail_of(phase: Array, share: Array, delay: Array, shape: int, m: int) -> Array:
    j = np.arange(m + 1)[:, None]
    late = (1 - 1j * j * delay / shape) ** -shape
    b: Array = np.exp(1j * j * phase) * (1 - share + share * late)
    return b


def bounds_of(unknowns: Array, shape: int, std: float, m: int) -> Array:
    """Cramer-Rao bounds (P) of the phase, with light, share of the tail and delay unknown."""

    def parts(each: Array) -> Array:
        b = (1 + each[3]) * tail_of(each[0], each[1], each[2], shape, m)
        return np.concatenate([b.real, b[1:].imag])

    step = 1e-6
    ahead = [parts(unknowns + step * np.eye(4)[k][:, None]) for k in range(4)]
    slope = np.stack([(each - parts(unknowns)) / step for each in ahead])
    information = np.einsum("ikp,jkp->pij", slope, slope) / std**2
    bound: Array = np.sqrt(np.linalg.inv(information)[:, 0, 0])
    return bound


@pytest.mark.parametrize("shape", [1, 2])
def test_tails_of_unknown_shape_are_near_the_bound_of_a_known_one(shape: int) -> None:
    pixels, m, std = 300, 4, 0.0035
    random = np.random.default_rng(8)
    phase, share = random.uniform(0.6, 2, pixels), random.uniform(0.2, 0.7, pixels)
    delay = np.exp(random.uniform(np.log(0.24), np.log(0.96), pixels))
    b, noise = noisy(tail_of(phase, share, delay, shape, m), std, seed=shape)

    found = tm.likelihood(b, noise)

    off = found.separate().phase_rad - phase
    bound = bounds_of(np.stack([phase, share, delay, 0 * phase]), shape, std, m)
    assert np.sqrt(np.mean(off**2)) < 3 * np.sqrt(np.mean(bound**2))
    z = np.abs(off) / found.direct_phase_std_rad()
    assert np.mean(z > 3) < 0.03
    assert 0.3 < np.median(z) < 1
