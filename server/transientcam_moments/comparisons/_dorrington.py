"""Two returns from two frequencies by non-linear least squares."""

from typing import Any

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._pixels import Complex, pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique

_LEAST = 2
_STARTS = 24  # phases around the turn among which pairs are tried
_TRIED = 10  # of these pairs


def dorrington(b: Array) -> SparseEstimate:
    """Fit two returns to b_1 and b_2, pixel by pixel.

    Two phases and two weights >= 0 against the four numbers that two frequencies give, by SciPy's
    `least_squares` (trust region reflective). It starts from the pairs of a coarse grid that fit
    best, because a descent from anywhere ends in local minima.
    """
    from scipy.optimize import least_squares  # heavy, and not needed by those who don't compare

    solve: Any = least_squares
    pixels = pixels_of(b, least=_LEAST, name="dorrington", last=_LEAST)
    c = pixels.b[1 : _LEAST + 1]
    phase = np.full((2, c.shape[1]), np.nan)
    weight = np.zeros_like(phase)
    bounds = ([-np.inf, -np.inf, 0.0, 0.0], np.inf)
    for pixel in np.flatnonzero(pixels.usable):
        wanted = _real(c[:, pixel])
        best = np.inf
        for start in _starts(wanted):
            found = solve(
                _residual, start, _jacobian, bounds, args=(wanted,), xtol=1e-12, ftol=1e-12
            )
            if found.cost < best:
                best, phase[:, pixel], weight[:, pixel] = found.cost, found.x[:2], found.x[2:]
            if best < 1e-20:
                break
    return pixels.sparse(phase, weight)


_ORDERS = np.array([1.0, 2.0])


def _real(c: Complex) -> Real:
    return np.concatenate([c.real, c.imag])


def _residual(x: Real, wanted: Real) -> Real:
    return _real((x[2:] * np.exp(1j * np.outer(_ORDERS, x[:2]))).sum(axis=1)) - wanted


def _jacobian(x: Real, wanted: Real) -> Real:
    waves = np.exp(1j * np.outer(_ORDERS, x[:2]))
    by_phase = 1j * _ORDERS[:, None] * waves * x[2:]
    columns = np.concatenate([by_phase, waves], axis=1)
    return np.concatenate([columns.real, columns.imag])


def _grid() -> tuple[Real, Real]:
    """Return pairs of phases (pairs, 2) and their waves (pairs, 4, 2)."""
    phases = np.arange(_STARTS) * (2 * np.pi / _STARTS)
    pairs = np.stack(np.triu_indices(_STARTS, k=1), axis=1)
    waves: Complex = np.exp(1j * _ORDERS[:, None] * phases[pairs][:, None, :])
    return phases[pairs], np.concatenate([waves.real, waves.imag], axis=1)


_PAIRS, _WAVES = _grid()
_INVERSE = np.linalg.pinv(_WAVES)


def _starts(wanted: Real) -> Real:
    """Return the best pairs (tried, 4) with their weights."""
    weight = np.maximum(_INVERSE @ wanted, 1e-3)
    error = ((_WAVES @ weight[..., None])[..., 0] - wanted) ** 2
    best = np.argsort(error.sum(axis=1))[:_TRIED]
    return np.concatenate([_PAIRS[best], weight[best]], axis=1)


TECHNIQUE = Technique(
    **TEXTS["dorrington"],
    harmonics=lambda m: (1, 2),
    least_harmonics=_LEAST,
    estimate=dorrington,
    planar=False,
)
