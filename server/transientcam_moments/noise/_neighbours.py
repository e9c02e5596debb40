"""Averaging moments over neighbouring pixels, but not across edges: adaptive weights."""

from typing import Final, NamedTuple

import numpy as np

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import Array, as_array, namespace, real_type, squared, summary
from transientcam_moments.errors import ShapeError
from transientcam_moments.noise._moments import MomentNoise

RADII_PX: Final = (1.5, 2.2, 4.5)
"""Of the neighbourhoods, one a round."""
REACH: Final = 4
"""Rows and columns beside a pixel that the largest neighbourhood reaches."""
MOST_MISFIT: Final = 4.0
"""Reduced chi-square of two pixels from which they are not averaged; half of it still is fully."""
MOST_SHIFT: Final = 8.0
"""The same for a common shift of all light in time, 1.5 times the chi-square of one number."""
MISFIT_OF_ONE: Final = 0.02
SHIFT_OF_ONE: Final = 0.001
"""Weights of a neighbour alone beside those of its mean with its mirror image."""
LONE: Final = 0.5
"""Share of its variance left, above which a pixel agreed with no pair of neighbours."""
OF_NOISE: Final = 5.0
"""Deviations of an average and of those beside it, up to which noise alone may part them."""
_NEAR: Final = ((0, 1), (1, 0), (1, 1), (1, -1))
BESIDE: Final = np.array(
    [[(y, x), (-y, -x)] for y, x in _NEAR]
    + [[(sign * y, sign * x)] * 2 for y, x in _NEAR for sign in (1, -1)]
)
"""Rows and columns of `OPPOSITE` neighbours and their mirror images, then of each by itself."""
OPPOSITE: Final = len(_NEAR)
EXPECTED: Final = 5.0
"""Chi-square of the clearest line of residuals that noise explains."""
CLEAR: Final = 12.0
"""And from which it is taken back: noise exceeds it in one pixel of five hundred."""
OF_CHOICE: Final = 2.0
"""Times the variance of its mean, as the clearest of twelve is chosen."""
_STEPS: Final = (
    ((0, 1), (0, 2)), ((1, 0), (2, 0)), ((1, 1), (2, 2)), ((1, -1), (2, -2)),
    ((1, 0), (2, 1)), ((-1, 0), (-2, -1)), ((1, 0), (2, -1)), ((-1, 0), (-2, 1)),
    ((0, 1), (1, 2)), ((0, -1), (-1, -2)), ((0, 1), (-1, 2)), ((0, -1), (1, -2)),
)  # fmt: skip
LINES: Final = np.array(
    [[[n * a + i * b for a, b in zip(*each, strict=True)] for i in range(-2, 3) for n in (0, 1)]
     for each in _STEPS]
)[:, :-1]  # fmt: skip
"""In eight directions: rows and columns of nine pixels around the middle one (12, 9, 2)."""


class Averaged(NamedTuple):
    """Moments averaged over neighbours.

    Attributes
    ----------
    moments : array, shape (m + 1, H, W)
    noise : MomentNoise
        What is left in each pixel by itself; pixels nearer than 9 px share noise.
    share : array, shape (H, W)
        Of a pixel's own variance that is left: one over the number of pixels averaged, and more
        where averaging may have flattened something.
    """

    moments: Array
    noise: MomentNoise
    share: Array

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def average_neighbours(
    moments: Array,
    noise: MomentNoise,
    *,
    multiples: tuple[int, ...] | None = None,
    left_out: Array | None = None,
    frames: Array | None = None,
    spread: Spread = at_once,
) -> Averaged:
    """Average each pixel with those neighbours whose moments differ by no more than noise.

    Parameters
    ----------
    moments : array, shape (m + 1, H, W)
        Calibrated, of each pixel by itself: not smoothed.
    noise : MomentNoise
        Theirs, (m + 1, H, W) or what broadcasts to it; 0 in planes that were not measured.
    multiples : tuple of int, optional
        Of the base frequency, one a plane: (0, 1, ..., m), when left out.
    left_out : boolean array, shape (H, W), optional
        Pixels, such as saturated ones, that stay as they are and count as nothing for the others;
        so do those with a moment that isn't finite, or without noise.
    frames : array, shape (H, W), optional
        How many frames the moments of each pixel, and their noise, are the mean of: its weight.
    spread : callable
        How the compiled kernel uses several threads, as `kernels.over` returns it.

    Returns
    -------
    Averaged

    Raises
    ------
    ShapeError
        When the moments are no image, or something else has another shape.

    Notes
    -----
    Propagation-separation (Polzehl and Spokoiny, 2006): in rounds of growing radius a neighbour's
    weight falls with its distance and with misfit over noise. The mean of a neighbour and its
    mirror image is held against the pixel, so that slanted surfaces pass, and both get one weight,
    so that noise does not move the mean along the slope; a second misfit is the one in the
    direction d b_j = i j b_j, all light later, so that small steps in range show. A pixel that its
    own noise puts off is left with few neighbours, which are off alike: within `OF_NOISE`
    deviations it gets the mean of the two averages beside it that rest on most pixels, if that is
    more than its own does, or the average of one side where it agreed with none. What is flattened
    leaves residuals of one sign along a line of nine pixels: where they are clear the pixel gets
    their mean back, with `OF_CHOICE` times its variance; else their square counts as noise.
    """
    moments = as_array(moments)
    if moments.ndim != 3:
        raise ShapeError("moments", f"of shape {tuple(moments.shape)}", "(m + 1, H, W)")
    order = tuple(range(len(moments)) if multiples is None else multiples)
    if len(order) != len(moments):
        raise ShapeError("multiples", f"{len(order)} numbers", f"{len(moments)}, one a plane")
    xp = namespace(moments)
    if left_out is not None and left_out.shape != moments.shape[1:]:
        raise ShapeError("left_out", f"of shape {tuple(left_out.shape)}", "(H, W) of the moments")
    try:
        variance = xp.broadcast_to(xp.asarray(noise.variance), moments.shape)
    except ValueError:
        shape = tuple(noise.variance.shape)
        raise ShapeError("noise", f"of shape {shape}", "that of the moments") from None
    known = (variance > 0) & (variance < np.inf)
    present = xp.isfinite(moments).all(axis=0) & known.any(axis=0)
    if left_out is not None:
        present = present & ~xp.asarray(left_out)
    real = real_type(moments)
    # by a power of two, which rounds nothing: no square leaves the numbers there are
    greatest = xp.maximum(xp.where(known, variance, 0).max(), np.finfo(real).tiny)
    size = (2.0 ** xp.ceil(xp.log2(greatest) / 2)).astype(real)
    weight = (size**2 / xp.where(known & present, variance, np.inf)).astype(real)
    measured = weight.max(axis=(1, 2)) > 0
    numbers = xp.maximum((measured * np.array([2 if j else 1 for j in order])).sum(), 1)
    raw = xp.where(present, moments, 0) * (1 / size)
    there = present.astype(real) if frames is None else xp.where(present, frames, 0).astype(real)
    found, share = _averaged(raw, weight, there, order, numbers, spread=spread)
    averaged = xp.where(present, found * size, moments)
    return Averaged(averaged, MomentNoise((variance * share).astype(share.dtype)), share)


def neighbourhood(radius_px: float) -> list[tuple[int, int, float]]:
    """Return row, column and weight of the neighbours within a radius, one of each mirrored two."""
    reach = range(-REACH, REACH + 1)
    pairs = [(row, column) for row in reach for column in reach if (row, column) > (0, 0)]
    weights = (1 - (row**2 + column**2) / (radius_px + 0.5) ** 2 for row, column in pairs)
    return [(*pair, weight) for pair, weight in zip(pairs, weights, strict=True) if weight > 0]


@accelerated("neighbours", of="F")
def _averaged(
    raw: Array, weight: Array, there: Array, multiples: tuple[int, ...], numbers: Array
) -> tuple[Array, Array]:
    """Planar statement: averages of moments with noise about 1, and the share of variance left.

    ``weight`` is one over the variances, ``there`` how many frames a pixel is the mean of, 0 where
    it is left out, ``numbers`` how many were measured in a pixel.
    """
    xp = namespace(raw)
    least = np.finfo(weight.dtype).tiny
    order = xp.asarray(np.array(multiples, weight.dtype))[:, None, None]
    current, share = raw, xp.ones_like(there)
    lit, given = _padded(there), _padded(raw * there)
    for radius_px in RADII_PX:
        wide = _padded(current)
        tangent = order * weight * current
        shift = 2 / MOST_SHIFT / xp.maximum((order * (tangent.conj() * current).real).sum(0), least)
        misfit = 1 / (MOST_MISFIT * numbers)
        total, square, mean = there, there, raw * there
        for row, column, place in neighbourhood(radius_px):
            ahead, behind = ((row, column), (-row, -column))
            by = [_shifted(lit, *offset) for offset in (ahead, behind)]
            near = [_shifted(wide, *offset) for offset in (ahead, behind)]
            near = [xp.where(by[i] > 0, near[i], near[1 - i]) for i in (0, 1)]  # both, or the one
            off, half = current - (near[0] + near[1]) / 2, (near[1] - near[0]) / 2
            one = (1 + MISFIT_OF_ONE) * squared(off) + MISFIT_OF_ONE * squared(half)
            two = (1 + SHIFT_OF_ONE) * (tangent.conj() * off).imag.sum(0) ** 2
            two = two + SHIFT_OF_ONE * (tangent.conj() * half).imag.sum(0) ** 2
            doubt = xp.maximum(misfit * (weight * one).sum(0), shift * two) / share
            agreement = place * xp.clip(2 - doubt, 0, 1)
            both = _shifted(given, *ahead) + _shifted(given, *behind)
            mean, counts = mean + agreement * both, agreement * (by[0] + by[1])
            total, square = total + counts, square + counts * agreement
        total = xp.maximum(total, least)
        current, share = mean / total, xp.where(there > 0, there * square / total / total, 1)
    current, share = _joined(current.astype(raw.dtype), share, weight, there, multiples, numbers)
    late = (order * weight * (current.conj() * raw).imag).sum(0)  # of what is left
    known = (order**2 * weight * squared(current)).sum(0)  # their own would be real
    clearest, shift, whole = _clearest_line(xp.stack([late, known]))
    whole, back = xp.maximum(whole, least), clearest > CLEAR
    turned = (1j * order * xp.where(back, shift / whole, 0)).astype(raw.dtype)
    doubt = xp.where(back, OF_CHOICE, xp.maximum(clearest - EXPECTED, 0)) * known / whole
    return current + turned * current, xp.minimum(share + doubt, 1).astype(weight.dtype)


def _joined(
    found: Array, share: Array, weight: Array, there: Array, multiples: tuple[int, ...],
    numbers: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Return averages and shares, of those beside where they rest on more and noise parts them."""
    xp, least = namespace(found), np.finfo(weight.dtype).eps ** 2  # frames: as good as none
    order = xp.asarray(np.array(multiples, weight.dtype))[:, None, None]
    wide, worth = _padded(found), _padded(there / share)
    own = 1 / xp.maximum(there / share, least)  # of the variance of one frame
    mean, best, allowed = found, own, there > 0
    for i, sides in enumerate(BESIDE.tolist()):
        if i == OPPOSITE:  # one side is off by a slope
            allowed = (share > LONE) & (best == own)
        near = (_shifted(wide, *sides[0]) + _shifted(wide, *sides[1])) / 2
        its = sum(0.5 / xp.maximum(_shifted(worth, *each), least) for each in sides)
        off, tangent = found - near, order * weight * near
        noise = there * (own + its)
        fits = allowed & (its < best)
        misfit = (weight * squared(off)).sum(0) / numbers
        fits = fits & (misfit < (1 + OF_NOISE * (2 / numbers) ** 0.5) * noise)
        known = (order * (tangent.conj() * near).real).sum(0)
        fits = fits & ((tangent.conj() * off).imag.sum(0) ** 2 < OF_NOISE**2 * noise * known)
        mean, best = xp.where(fits, near, mean), xp.where(fits, its, best)
    return mean, xp.where(there > 0, there * best, 1)


def _clearest_line(both: Array) -> Array:
    """Return the greatest chi-square of residuals along a line, and their sums along it."""
    xp, wide = namespace(both), _padded(both)
    best = xp.zeros((3, *both.shape[1:]), both.dtype)
    for line in LINES.tolist():
        late, known = xp.stack([_shifted(wide, *each) for each in line]).sum(axis=0)
        clear = late**2 / xp.maximum(known, np.finfo(both.dtype).tiny)
        best = xp.where(clear > best[0], xp.stack([clear, late, known]), best)
    return best


def _padded(planes: Array) -> Array:
    margin = [(0, 0)] * (planes.ndim - 2) + [(REACH, REACH)] * 2
    return namespace(planes).pad(planes, margin)


def _shifted(padded: Array, row: int, column: int) -> Array:
    """Return what lies so many rows and columns further; 0 beyond the border."""
    height, width = (length - 2 * REACH for length in padded.shape[-2:])
    return padded[..., REACH + row :, REACH + column :][..., :height, :width]
