"""The compiled search for peaks against samples of the density, and the planar statement."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from tests.moments import oracles
from tests.moments.compiled_kernels import find, kernels, without_kernels
from transientcam_compiled import over
from transientcam_moments.moment_problem._peaks import PEAK_THRESHOLD

ORDERS = [1, 3, 12]
TYPES = [np.complex64, np.complex128]
Array = NDArray[Any]


@pytest.fixture(autouse=True, scope="module")
def compiled() -> Iterator[None]:
    with kernels(*ORDERS, names=("peaks",)):
        yield


def found_by_kernel(c: tm.Coefficients, threshold: float, **how: Any) -> tuple[Array, ...]:
    kernel = find("peaks", c.polynomial)
    assert kernel is not None
    found: tuple[Array, ...] = kernel(c.polynomial, c.reflection, c.error, threshold, **how)
    return found


def coefficients(m: int, dtype: type, *, pixels: int = 500) -> tm.Coefficients:
    """Of few and many returns, sharp and blunt ones, at equal phases, and of special pixels."""
    random = np.random.default_rng(m)
    parts = [
        oracles.random_moments(random, m, pixels // 5, noise=noise) for noise in (0, 0.02, 0.1)
    ]
    phase, weight = oracles.random_returns(random, returns=2, pixels=pixels // 5)
    parts += [oracles.moments_of_returns(phase, weight, m) * [[1.0 + 1e-3]] + 0j]
    phase[1] = phase[0] + 2 * np.pi / (m + 1)  # coalesce or just do not
    parts += [oracles.moments_of_returns(phase, weight, m)]
    b = np.concatenate(parts, axis=1)
    b[0] *= 1.01
    special = {7: 0.0, 77: np.nan, 177: np.inf, 277: 1e-38}
    for place, factor in special.items():
        with np.errstate(all="ignore"):
            b[:, place] *= factor
    b[1:, 377] = 0  # uniform
    with np.errstate(all="ignore"), without_kernels():
        return tm.levinson(tm.bias(b.astype(dtype)).moments)


@pytest.mark.parametrize("epsilon", [0.004, 0.5])
@pytest.mark.parametrize("m", ORDERS)
def test_all_local_maxima_are_found(m: int, epsilon: float) -> None:
    b = oracles.random_moments(np.random.default_rng(m), m, 64, noise=0.1)
    with without_kernels():
        c = tm.levinson(tm.bias(b, epsilon).moments)
        phase_rad = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
        h = tm.density(c, phase_rad)
    higher = (h > np.roll(h, 1, axis=0)) & (h >= np.roll(h, -1, axis=0))

    _, _, found_rad, height = found_by_kernel(c, 0.0)

    for pixel in range(64):
        mine = found_rad[height[:, pixel] > 0, pixel]
        expected = phase_rad[higher[:, pixel]]
        assert len(mine) == len(expected)
        assert oracles.around(np.sort(mine) - expected).max(initial=0) < 2e-3


@pytest.mark.parametrize("threshold", [0.0, 0.1, 0.7])
@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("m", ORDERS)
def test_peaks_follow_the_planar_statement(m: int, dtype: type, threshold: float) -> None:
    c = coefficients(m, dtype)

    first, strongest, phase, height = found_by_kernel(c, threshold)

    with without_kernels():
        planar = tm.peaks(c, threshold=threshold)
    # one of two that rounding can tell from none, or from one, or from the higher one
    counts = (height > 0).sum(axis=0) == (planar.density > 0).sum(axis=0)
    assert np.count_nonzero(~counts) <= 2
    same = float(np.finfo(first.dtype).eps) ** 0.5
    for found, expected in ((first, planar.first_rad), (phase, planar.phase_rad)):
        assert found.dtype == expected.dtype
        assert found.shape == expected.shape
        off = oracles.around(found - expected)[..., counts]
        assert np.array_equal(np.isnan(off), np.isnan(expected[..., counts]))
        assert np.nanquantile(off, 0.99) < same
    off = oracles.around(strongest - planar.strongest_rad)
    assert np.isnan(off[[7, 77, 377]]).all()
    assert np.nanmean(off < same) > 0.98  # the two highest may be equally high


def test_parts_on_threads_give_the_same_bits() -> None:
    c = coefficients(3, np.complex64)

    whole = found_by_kernel(c, 0.1)
    with ThreadPoolExecutor(2) as executor:

        def spread(part: Any, total: int, /, unit: int = 1024, each: int = 1) -> None:
            over(executor, 3)(part, total, 64, each)

        parts = found_by_kernel(c, 0.1, spread=spread)

    for one, other in zip(whole, parts, strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_call_uses_the_kernel() -> None:
    c = coefficients(3, np.complex64)

    found = tm.peaks(tm.Coefficients(*(part.reshape((*part.shape[:-1], 20, 25)) for part in c)))

    assert found.first_rad.shape == (20, 25)
    assert found.phase_rad.shape == (3, 20, 25)
    assert found.phase_rad.tobytes() == found_by_kernel(c, PEAK_THRESHOLD)[2].tobytes()
