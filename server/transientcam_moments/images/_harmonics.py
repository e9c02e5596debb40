"""Odd harmonics of the modulation, which a phase sweep measures, taken out of the moments.

The four-bucket difference of Sec. 3.1 removes the even harmonics of the correlation of light and
reference; the sub-phases of Sec. 4.1 weaken the odd ones. What is left of them adds moments of
higher order: with c_k the k-th harmonic of the correlation at frequency j, and u the phase factor
of the pixel,

    a_j = c_1 u b_j + conj(c_3 u^3 b_3j) + c_5 u^5 b_5j + conj(c_7 u^7 b_7j) + ...              (1)

as exp(-i k theta) at the four phases theta sums to the phasor of k = 1 or, for k = 3, 7, ..., of
its conjugate. A calibration (Sec. 4.2) sees b = 1 and divides by g_j = a_j of all ones, which
leaves

    b~_j = (1 - s_j) b_j + d_3j conj(b_3j) + d_5j b_5j + ...,   s_j = d_3j + d_5j + ...         (2)

Equation (2) is solved by iteration: the moments found so far have higher ones b_kj (spectral
extension of the maximum entropy estimate, see `extend`), which are subtracted from b~_j.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import (
    Array,
    bank,
    by_blocks,
    moment_planes,
    namespace,
    parts,
    to_complex,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images._calibration import inverse_gains
from transientcam_moments.images._smoothing import smooth
from transientcam_moments.images._sweep import odd_orders
from transientcam_moments.moment_problem import bias, estimate_zeroth, extension, levinson

ROUNDS = 3
"""Of the iteration; the third changes moments by 1e-4 b_0 where harmonics have 3 % (docs)."""
NEGLIGIBLE = 5e-4
"""A harmonic with less than this share of the fundamental at all frequencies is left out."""
_BLOCK_PIXELS = 2048  # of up to 120 planes, which stay in the second cache
_PHASE_STEPS = 30  # at most, of the fixed point for the phase of a pixel
_PHASE_TOLERANCE = 1e-8


class Corrected(NamedTuple):
    """Moments without the known harmonics.

    Attributes
    ----------
    moments : array, shape (m + 1, ...)
        b_0 as it was.
    corrected : boolean array, shape (...)
        Where they differ from those that were given.
    """

    moments: Array
    corrected: Array


class HarmonicCorrection:
    """Takes known harmonics out of calibrated moments; prepared once for all frames.

    Parameters
    ----------
    waveform : array, shape (m, K)
        c_3 / c_1, c_5 / c_1, ... of each frequency, from `waveform_of`.
    calibration : array, shape (m + 1,) or (m + 1, ...)
        Gains that the moments were divided by, measured with the same waveform: their phases are
        those of the pixels.
    shape : tuple of int
        Of the pixels.
    smoothing_sigma_px : float
        The moments were smoothed by it.
    estimated : bool
        b_0 was not measured.

    Raises
    ------
    ShapeError
        When the waveform is not (m, K) numbers, or the calibration does not fit it and the pixels.
    ParameterError
        When harmonics are not finite, or too strong, see `checked_waveform`.
    """

    def __init__(
        self,
        waveform: Array,
        calibration: Array,
        shape: tuple[int, ...],
        *,
        smoothing_sigma_px: float = 0.0,
        estimated: bool = False,
    ) -> None:
        waveform = checked_waveform(waveform)
        m, pixels = len(waveform), math.prod(shape)
        kept = np.flatnonzero(_matters(waveform))
        self._estimated = estimated
        self._orders = tuple(int(2 * i + 3) for i in kept)
        inverse = inverse_gains(calibration, (m + 1, *shape))[1:]  # of the opposite phase
        parts = _relative(waveform[:, kept], self._orders, np.conj(inverse))
        planes = np.empty((len(kept) + 1, m, *inverse.shape[1:]), np.complex64)
        with np.errstate(invalid="ignore"):
            planes[0] = scale = 1 / (1 + sum(parts()))
            for plane, part in zip(planes[1:], parts(), strict=True):
                plane[...] = part * scale
        planes = planes.reshape((-1, *(inverse.shape[1:] or (1,) * len(shape))))
        planes = np.ascontiguousarray(np.broadcast_to(planes, (len(planes), *shape)))
        if smoothing_sigma_px > 0 and len(shape) == 2:  # (2) is linear: exact where b is smooth
            planes = smooth(planes, smoothing_sigma_px)
        planes = planes.reshape((-1, pixels))
        self._mixed = planes[m:]
        with np.errstate(divide="ignore", invalid="ignore"):
            self._inverse = 1 / planes[:m]

    def __call__(self, moments: Array, *, spread: Spread = at_once) -> Corrected:
        """Take the harmonics out of moments (m + 1, ...).

        The misfit of moments b is the distance of what (2) makes of them and of their extension
        from b~. Each pixel keeps the iterate of the least misfit, which may be what it
        was given: the misfit never grows.
        """
        planes, trailing = moment_planes(moments)
        xp = namespace(planes)
        best = current = planes
        corrected = xp.zeros(planes.shape[1:], dtype=bool)
        least = None
        for _ in range(ROUNDS + 1 if self._orders else 0):
            following, misfit = self._round(planes, current, spread)
            if least is None:
                least = misfit
            else:
                better = misfit < least
                best = xp.where(better, current, best)
                least = xp.where(better, misfit, least)
                corrected = corrected | better
            current = following
        return Corrected(best.reshape((len(planes), *trailing)), corrected.reshape(trailing))

    def _round(self, given: Array, current: Array, spread: Spread) -> tuple[Array, Array]:
        """Return the next iterate, and the square of the present one's misfit."""
        valid = estimate_zeroth(current) if self._estimated else bias(current).moments
        polynomial = levinson(valid).polynomial
        found: tuple[Array, Array] = _without_harmonics(
            given, current, polynomial, self._mixed, self._inverse, self._orders, spread=spread
        )
        return found


def checked_waveform(waveform: Array) -> Array:
    """Return a waveform (m, K) as complex128, where `HarmonicCorrection` can take it out.

    By (1) the phase of a gain is that of u (1 + r), r the sum of |c_k / c_1| u^(k - 1) and
    u^-(k + 1). It determines u as long as the phase of 1 + r turns more slowly than u, so that
    the sum of (k - 1) |c_k| or (k + 1) |c_k| over |c_1| must be below 1.

    Raises
    ------
    ShapeError
        When it is not (m, K) numbers.
    ParameterError
        When harmonics are not finite, or that sum is not below 1.
    """
    found = np.asarray(waveform)
    if found.ndim != 2 or not len(found) or found.dtype.kind not in "iufc":
        raise ShapeError("waveform", f"{found.dtype} of shape {found.shape}", "numbers (m, K)")
    turning = np.abs(found) @ [4.0 * _fourths(k) for k in odd_orders(found.shape[1])]
    if not (turning < 1).all():
        limit = "finite, the sum of (k - 1) |c_k / c_1| (k = 5, 9, ..) and (k + 1) |c_k / c_1| < 1"
        raise ParameterError("waveform", float(turning.max()), limit)
    return found.astype(np.complex128)


def matters(waveform: Array) -> bool:
    """Say whether any harmonic is large enough to be taken out."""
    return bool(_matters(waveform).any())


def _matters(waveform: Array) -> Array:
    return (np.abs(waveform) > NEGLIGIBLE).any(axis=0)


def _fourths(k: int) -> int:
    """Return l of u^4l or u^-4l, which harmonic k has: k - 1 for 5, 9, .., k + 1 for 3, 7, .."""
    return (k + 1) // 4


def _relative(
    waveform: Array, orders: tuple[int, ...], gains: Array
) -> Callable[[], Iterator[Array]]:
    """Return what gives d_kj / (1 - s_j) (m, ...), k by k: c_k, c_1 > 0, over c_1 in (1), b = 1.

    All are powers of u^4: u^-(k+1) for k = 3, 7, ... and u^(k-1) for k = 5, 9, ...
    """
    columns = waveform.T.reshape((len(orders), len(gains), *(1,) * (gains.ndim - 1)))

    def parts() -> Iterator[Array]:
        fourth = np.square(np.square(u))
        power = np.ones_like(fourth)
        done = 0
        for k, column in zip(orders, columns, strict=True):
            for _ in range(_fourths(k) - done):
                power = power * fourth
            done = _fourths(k)
            yield np.conj(column * power) if k % 4 == 3 else column * power

    with np.errstate(divide="ignore", invalid="ignore"):
        turn = u = gains / np.abs(gains)
        for _ in range(_PHASE_STEPS):  # u is the phase of the fundamental alone
            before, u = u, turn / (1 + sum(parts()))
            u = u / np.abs(u)
            if not (np.abs(u - before) > _PHASE_TOLERANCE).any():
                break
    return parts


@accelerated("harmonics", of="F")
def _without_harmonics(
    given: Array,
    current: Array,
    polynomial: Array,
    mixed: Array,
    inverse: Array,
    orders: tuple[int, ...],
) -> tuple[Array, Array]:
    """Solve (2) for b_1 .. b_m, the higher moments those of the extension.

    Planes of pixels: ``mixed`` (K m, P) is d_kj, k by k, ``inverse`` (m, P) is 1 / (1 - s_j).
    """
    arrays = (given, current, polynomial, mixed, inverse)
    found = by_blocks(partial(_unmixed, orders), *arrays, pixels=_BLOCK_PIXELS)
    return found[0], found[1]


def _unmixed(
    orders: tuple[int, ...],
    given: Array,
    current: Array,
    polynomial: Array,
    mixed: Array,
    inverse: Array,
) -> tuple[Array, Array]:
    order = (0,) * (len(given) - 1)
    m = len(order)
    xr, xi = parts(given)
    re, im = (bank(xr[0], (0,) * (m * orders[-1]), 1) for _ in range(2))
    re[: m + 1], im[: m + 1] = parts(current)
    extension.extend(order, m * orders[-1], *parts(polynomial), re, im)
    (dr, di), (sr, si) = parts(mixed), parts(inverse)
    misfit = 0 * xr[0]
    for j in range(1, m + 1):
        x, y = xr[j], xi[j]
        for i, k in enumerate(orders):
            at = i * m + j - 1
            x, y = extension.without_harmonic(k, dr[at], di[at], re[k * j], im[k * j], x, y)
        x, y = x * sr[j - 1] - y * si[j - 1], x * si[j - 1] + y * sr[j - 1]
        xr[j], xi[j] = x, y
        misfit = misfit + ((x - re[j]) * (x - re[j]) + (y - im[j]) * (y - im[j]))
    xp = namespace(given)
    return to_complex(xp.stack(xr), xp.stack(xi)), misfit
