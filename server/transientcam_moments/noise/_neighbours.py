"""Averaging moments over neighbouring pixels, but not across edges: adaptive weights."""

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from transientcam_compiled import Spread, at_once
from transientcam_moments._dispatch import accelerated
from transientcam_moments.arrays import Array, as_array, namespace, real_type, squared, summary
from transientcam_moments.errors import ShapeError
from transientcam_moments.noise._moments import MomentNoise

RADII_PX: Final = (1.5, 2.2, 3.2, 4.5)
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
OF_NOISE: Final = 4.0
"""Deviations by which noise alone may put such a pixel off."""
_BESIDE: Final = np.array([[0, 1, 1, 1], [1, 0, 1, -1]])[..., None]
"""Rows and columns of four neighbours, opposite to four others."""
EXPECTED: Final = 5.0
"""Chi-square of the clearest line of residuals that noise explains."""
CLEAR: Final = 12.0
"""And from which it is taken back: noise exceeds it in one pixel of five thousand."""
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
    direction d b_j = i j b_j, all light later, so that small steps in range show. Of pixels that
    agree with no pair noise has put more off than structure has: within `OF_NOISE` deviations they
    get the average of both sides beside them, or of one where no two agree. What is flattened
    leaves residuals of one sign along a line of nine pixels: where they are clear the pixel gets
    their mean back, with its variance; else their square counts as noise.
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
    lit, given = _padded(there), _padded(raw)
    for radius_px in RADII_PX:
        wide = _padded(current)
        tangent = order * weight * current
        shift = 2 / MOST_SHIFT / xp.maximum((order * (tangent.conj() * current).real).sum(0), least)
        misfit = 1 / (MOST_MISFIT * numbers)
        total, square, mean = there, there, raw * there
        for row, column, place in neighbourhood(radius_px):
            ahead, behind = ((row, column), (-row, -column))
            by = [_shifted(lit, *offset) for offset in (ahead, behind)]
            off = [current - _shifted(wide, *offset) for offset in (ahead, behind)]
            alone = [(weight * squared(each)).sum(0) for each in off]
            later = [(tangent.conj() * each).imag.sum(0) for each in off]
            product = (weight * (off[0] * off[1].conj()).real).sum(0)
            both = (alone[0] + alone[1]) / 4 + product / 2
            mirrored = ((later[0] + later[1]) / 2) ** 2
            beside = (alone[0] + alone[1]) / 2, (later[0] ** 2 + later[1] ** 2) / 2
            both, mirrored = both + MISFIT_OF_ONE * beside[0], mirrored + SHIFT_OF_ONE * beside[1]
            for i, offset in enumerate((ahead, behind)):
                paired, single = by[1 - i] > 0, later[i] ** 2
                one = xp.where(paired, both, (1 + MISFIT_OF_ONE) * alone[i])
                two = xp.where(paired, mirrored, (1 + SHIFT_OF_ONE) * single)
                doubt = xp.maximum(misfit * one, shift * two) / share
                agreement = place * xp.clip(2 - doubt, 0, 1)
                counts = by[i] * agreement
                mean = mean + counts * _shifted(given, *offset)
                total, square = total + counts, square + counts * agreement
        total = xp.maximum(total, least)
        current, share = mean / total, xp.where(there > 0, there * square / total / total, 1)
    return finished(raw, current.astype(raw.dtype), share, weight, there, multiples, numbers)


def _joined(
    raw: Array, found: Array, share: Array, weight: Array, there: Array,
    multiples: tuple[int, ...], numbers: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Return averages and shares with those of neighbours where a pixel was left alone by noise."""
    xp, lone = namespace(raw), (share > LONE) & (there > 0)
    known_values = isinstance(lone, np.ndarray)  # few are looked at; else all, as there is no count
    places = np.flatnonzero(lone) if known_values else xp.arange(lone.size)
    row, column = (each + REACH for each in divmod(places, share.shape[1]))
    sides = [(row + way * _BESIDE[0], column + way * _BESIDE[1]) for way in (1, -1)]

    def beside(planes: Array, both: Callable[..., Array]) -> Array:
        """Return what is on both sides (..., 12, P), and on each."""
        ahead, behind = (_padded(planes)[..., r, c] for r, c in sides)
        return xp.concatenate([both(ahead, behind), ahead, behind], axis=-2)

    mean, its = (beside(each, lambda a, b: (a + b) / 2) for each in (found, share))
    own, of_one = (each.reshape((len(each), 1, -1))[..., places] for each in (raw, weight))
    order = xp.asarray(np.array(multiples, weight.dtype))[:, None, None]
    off, tangent = own - mean, order * of_one * mean
    misfit = (of_one * squared(off)).sum(0) / numbers
    later = (tangent.conj() * off).imag.sum(0) ** 2
    noise = (misfit < 1 + OF_NOISE * (2 / numbers) ** 0.5) & (its < LONE)
    noise = noise & (later < OF_NOISE**2 * (order * (tangent.conj() * mean).real).sum(0))
    misfit = xp.where(noise & (beside(there, xp.minimum) > 0), misfit, np.inf)
    pairs = misfit[: _BESIDE.shape[1]]  # before one side, which is off by a slope
    paired, any_of_them = (xp.isfinite(each.min(axis=0)) for each in (pairs, misfit))
    best = xp.where(paired, pairs.argmin(axis=0), misfit.argmin(axis=0))[None]
    mean = xp.where(any_of_them, xp.take_along_axis(mean, best[None], axis=1)[:, 0], own[:, 0])
    its = xp.where(any_of_them, xp.take_along_axis(its, best, axis=0)[0], share.reshape(-1)[places])
    if known_values:
        found, share = found.copy(), share.copy()
        found.reshape((len(found), -1))[:, places], share.reshape(-1)[places] = mean, its
        return found, share
    mean, its = mean.reshape(found.shape), its.reshape(share.shape)
    return xp.where(lone, mean, found), xp.where(lone, its, share)


def finished(
    raw: Array, current: Array, share: Array, weight: Array, there: Array,
    multiples: tuple[int, ...], numbers: Array, search: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """Return averages and shares of all rounds once lone pixels and residuals are looked at."""
    xp = namespace(raw)
    current, share = _joined(raw, current, share, weight, there, multiples, numbers)
    order = xp.asarray(np.array(multiples, weight.dtype))[:, None, None]
    scaled = order * weight
    late = (scaled * (current.conj() * raw).imag).sum(0)  # of what is left: their own is real
    known = (order * scaled * squared(current)).sum(0)
    clearest, shift, whole = (search or _clearest_line)(xp.stack([late, known]))
    whole, back = xp.maximum(whole, np.finfo(weight.dtype).tiny), clearest > CLEAR
    turned = (1j * order * xp.where(back, shift / whole, 0)).astype(current.dtype)
    doubt = xp.where(back, 1, xp.maximum(clearest - EXPECTED, 0)) * known / whole
    return current + turned * current, xp.minimum(share + doubt, 1).astype(weight.dtype)


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
