"""The smallest eigenvalue of the Toeplitz matrix, and the corrections that rest on it (Sec. 4.3).

The smallest eigenvalue lambda of B is the strength of the uniform part of the signal, negative
where the moments contradict each other (Prop. 1).
"""

from typing import NamedTuple

import numpy as np

from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import (
    BLOCK_PIXELS,
    Array,
    by_blocks,
    chosen,
    in_range,
    moment_planes,
    namespace,
    summary,
)
from transientcam_moments.moment_problem import _eigenvalue as eigenvalue
from transientcam_moments.moment_problem._levinson import normalised

EPSILON = 4e-3
"""The paper's least uniform part, relative to b_0 (Sec. 6)."""

ROUNDING = 4.0
"""An eigenvalue counts as smaller than epsilon b_0 by more than this many eps a moment, b_0 = 1."""

_BLOCK_NUMBERS = 1 << 19


class Biased(NamedTuple):
    """Moments that are valid with a margin.

    Attributes
    ----------
    moments : array, shape (m + 1, ...)
        With smallest eigenvalue >= epsilon b_0, up to rounding.
    biased : boolean array, shape (...)
        Where the moments had to be changed.
    """

    moments: Array
    biased: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def smallest_eigenvalue(b: Array) -> Array:
    """Return the smallest eigenvalue of the Hermitian Toeplitz matrix of every pixel.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments; the imaginary part of b_0 is ignored. b_0 may be anything, also 0
        where it was not measured.

    Returns
    -------
    array, shape (...)
        In the unit of b_0 and the precision of `b`; absolute error of a few eps times the largest
        moment. NaN where a moment is NaN or infinite.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers.

    Notes
    -----
    Sec. 4.3 and 5.1; Householder's reflections, then Laguerre's iteration. JAX compiles it, `bias`
    and `estimate_zeroth`, but has no derivative of them: `jax.grad` raises ValueError, and forward
    mode gives NaN. What follows from moments that need no biasing (`levinson`, `density`) has one.
    """
    planes, trailing = moment_planes(b)
    return _eigenvalues(planes).reshape(trailing)


def bias(
    b: Array, epsilon: float = EPSILON, *, keep: str = "harmonics", eigenvalue: Array | None = None
) -> Biased:
    """Make moments valid wherever they are not: smallest eigenvalue >= epsilon b_0 afterwards.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments.
    epsilon : float
        Least uniform part relative to b_0, 0 <= epsilon < 1.
    keep : {"harmonics", "brightness"}
        What stays as it is: b_1 .. b_m while b_0 is raised, or b_0 while the others are scaled
        down. Both give the same density up to its brightness.
    eigenvalue : array, shape (...), optional
        Smallest eigenvalue of `b`, where it is at hand already.

    Returns
    -------
    Biased
        The moments and where they were changed. Invalid pixels (NaN) are passed on unchanged, and
        so are pixels with b_0 <= 0 when the brightness is kept.

    Raises
    ------
    ParameterError
        For an `epsilon` outside of [0, 1) or another `keep`.

    Notes
    -----
    Sec. 4.3. The paper adds epsilon - lambda to b_0; here b_0 becomes (b_0 - lambda) /
    (1 - epsilon), which differs by epsilon times the change and makes the bound hold for the new
    b_0, so that biasing twice changes nothing.
    """
    in_range("epsilon", epsilon, 0.0, float(np.nextafter(1.0, 0.0)), "0 <= epsilon < 1")
    chosen("keep", keep, ("harmonics", "brightness"))
    planes, trailing = moment_planes(b)
    smallest: Array = smallest_eigenvalue(planes) if eigenvalue is None else eigenvalue
    moments, biased = _bias(planes, smallest.reshape(-1), epsilon, keep)
    return Biased(moments.reshape((planes.shape[0], *trailing)), biased.reshape(trailing))


def estimate_zeroth(b: Array, epsilon: float = EPSILON) -> Array:
    """Replace b_0 by the least brightness that explains b_1 .. b_m with a uniform part.

    Parameters
    ----------
    b : array, shape (m + 1, ...)
        Trigonometric moments; b_0 is ignored.
    epsilon : float
        Uniform part that the result has, relative to its b_0, 0 <= epsilon < 1.

    Returns
    -------
    array, shape (m + 1, ...)
        The moments with the estimated b_0.

    Raises
    ------
    ParameterError
        For an `epsilon` outside of [0, 1).

    Notes
    -----
    Sec. 4.3: with a zero diagonal the smallest eigenvalue is lambda < 0; b_0 - (-lambda) =
    epsilon b_0.
    """
    in_range("epsilon", epsilon, 0.0, float(np.nextafter(1.0, 0.0)), "0 <= epsilon < 1")
    planes, trailing = moment_planes(b)
    xp = namespace(planes)
    without = xp.concatenate([xp.zeros_like(planes[:1]), planes[1:]])
    zeroth = -smallest_eigenvalue(without) / (1 - epsilon)  # b_0 + lambda = epsilon b_0
    zeroth = zeroth.astype(planes.dtype)
    return xp.concatenate([zeroth[None], planes[1:]]).reshape((planes.shape[0], *trailing))


def _bias(b: Array, eigenvalue: Array, epsilon: float, keep: str) -> tuple[Array, Array]:
    """Planar statement of `bias`."""
    xp = namespace(b)
    b0 = b[0].real
    with np.errstate(all="ignore"):
        # less by rounding is what moments have that were biased, or whose b_0 was estimated
        rounding = ROUNDING * len(b) * float(np.finfo(b0.dtype).eps)
        biased = eigenvalue < (epsilon - rounding) * b0
        if keep == "harmonics":
            # b_0 := (b_0 - lambda) / (1 - epsilon) (Sec. 4.3, see `bias`)
            raised = xp.where(biased, (b0 - eigenvalue) / (1 - epsilon), b0)
            return xp.concatenate([raised.astype(b.dtype)[None], b[1:]]), biased
        biased = biased & (b0 > 0)
        factor = xp.where(biased, (1 - epsilon) * (b0 / (b0 - eigenvalue)), 1.0).astype(b0.dtype)
        return xp.concatenate([b0.astype(b.dtype)[None], b[1:] * factor]), biased


@accelerated("smallest_eigenvalue")
def _eigenvalues(b: Array) -> Array:
    # a matrix of planes stays in the caches
    pixels = min(BLOCK_PIXELS, max(256, _BLOCK_NUMBERS // b.shape[0] ** 2))
    return by_blocks(lambda part: (_smallest_eigenvalue(part),), b, pixels=pixels)[0]


def _smallest_eigenvalue(b: Array) -> Array:
    """Do as `smallest_eigenvalue` does with planes: b (m + 1, P) to (P)."""
    order = (0,) * (b.shape[0] - 1)
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        re, im, scale = normalised(b)
        return scale * eigenvalue.smallest_eigenvalue(order, re, im)
