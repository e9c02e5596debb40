"""Averaging moments over frames where nothing changes: a recursive mean, begun anew by a test."""

import math
from functools import lru_cache
from statistics import NormalDist
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.arrays import Array, in_range, summary
from transientcam_moments.errors import ShapeError
from transientcam_moments.noise._moments import MomentNoise

MOST_FRAMES: Final = 256
CHANGED: Final = 4.0
"""Deviations of the new frame from the mean, from which on a pixel has changed."""
DRIFTED: Final = 5.0
"""The same of a mean over `RECENT` frames, and of means over 3 x 3 and 9 x 9 pixels."""
DOUBTFUL: Final = 2.0
"""The same of a pixel with `BESIDE` others around it that have changed."""
BESIDE: Final = 2
AMIDST: Final = 5
"""Pixels around one, of eight, that have changed, with which it has changed, too."""
RECENT: Final = 16
LIT: Final = 20.0
"""Least size of the mean over its noise, from which on its brightness is tested by itself."""
_Planes = NDArray[np.floating]


class Still(NamedTuple):
    """Moments averaged over the frames since the last change of each pixel.

    Attributes
    ----------
    moments : array, shape (m + 1, H, W)
    noise : MomentNoise
        Theirs: that of one frame over ``frames``.
    frames : array, shape (H, W)
        How many frames a pixel is the mean of; at least 1.
    mean, recent : array, shape (2, m + 1, H, W)
        Real and imaginary parts of means over all frames and over the last ones, for the next call.
    seen : array, shape (H, W)
        How many frames these have seen; 0 where there are none.
    """

    moments: Array
    noise: MomentNoise
    frames: Array
    mean: _Planes
    recent: _Planes
    seen: _Planes

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)


def average_frames(
    moments: Array,
    noise: MomentNoise,
    before: Still | None = None,
    *,
    most_frames: int = MOST_FRAMES,
    multiples: tuple[int, ...] | None = None,
    left_out: Array | None = None,
    corrupt: bool = False,
) -> Still:
    """Average each pixel with the frames before, as long as it differs by no more than noise.

    Parameters
    ----------
    moments : NumPy array, shape (m + 1, H, W)
        Of the new frame, calibrated, of each pixel by itself: not smoothed.
    noise : MomentNoise
        Theirs, (m + 1, H, W) or what broadcasts to it; 0 in planes that were not measured.
    before : Still, optional
        What this returned of the frame before; all begins anew without.
    most_frames : int
        1 to 256. When a pixel has so many, older ones count less: its variance stays 1 / most.
    multiples : tuple of int, optional
        Of the base frequency, one a plane: (0, 1, ..., m), when left out.
    left_out : boolean array, shape (H, W), optional
        Pixels, such as saturated ones, that stay as they are and begin anew with the next frame; so
        do those with a moment that isn't finite, or without noise.
    corrupt : bool
        Whether images of the frame are not as they were captured: it does not enter the means.

    Returns
    -------
    Still
        A pixel that has changed has the moments of this frame to the bit.

    Raises
    ------
    ParameterError
        When `most_frames` is out of range.
    ShapeError
        When shapes do not fit each other.

    Notes
    -----
    A pixel has changed where the frame is off the mean by what noise exceeds as rarely as `CHANGED`
    deviations: in chi-square of all moments, in the direction d b_j = i j b_j (all light later) or
    d b_j = b_j (all light brighter). These two are also summed over 3 x 3 and 9 x 9 pixels, so that
    a change of half a deviation shows where it is wide; and the mean of the last `RECENT` frames is
    held against that of all in the same ways, so that drift shows before it is as large as the
    noise of a frame. With n frames their difference has the variance 1 / `RECENT` - 1 / n.
    """
    in_range("most_frames", most_frames, 1, MOST_FRAMES, f"1 to {MOST_FRAMES}")
    moments = np.asarray(moments)
    if moments.ndim != 3:
        raise ShapeError("moments", f"of shape {moments.shape}", "(m + 1, H, W)")
    shape = moments.shape[1:]
    order = np.array(range(len(moments)) if multiples is None else multiples)
    if len(order) != len(moments):
        raise ShapeError("multiples", f"{len(order)} numbers", f"{len(moments)}, one a plane")
    if left_out is not None and np.shape(left_out) != shape:
        raise ShapeError("left_out", f"of shape {np.shape(left_out)}", "(H, W) of the moments")
    if before is not None and before.mean.shape[1:] != moments.shape:
        raise ShapeError("before", f"of shape {before.mean.shape[1:]}", "that of the moments")
    new = np.stack([moments.real, moments.imag])
    try:
        variance = np.broadcast_to(np.asarray(noise.variance, new.dtype), moments.shape)
    except ValueError:
        given = np.shape(noise.variance)
        raise ShapeError("noise", f"of shape {given}", "that of the moments") from None
    with np.errstate(all="ignore"):  # of pixels that aren't finite, or from far out of scale
        weight = np.where((variance > 0) & (variance < np.inf), 1 / variance, 0)
        present = np.isfinite(moments.sum(axis=0)) & (weight.sum(axis=0) > 0)
        if left_out is not None:
            present &= ~np.asarray(left_out)
        if before is None:
            nothing = np.zeros(shape, new.dtype)
            before = Still(moments, noise, nothing, new, new, nothing)
        seen = before.seen
        stays = present & (seen > 0)
        stays &= ~_changed(new, before, weight, order, stays)
        if corrupt:
            mean = np.where(stays, before.mean, new)
            frames, after = np.where(stays, seen, 1), (before.mean, before.recent, seen)
        else:
            mean = _advanced(before.mean, new, seen, stays, most_frames)
            recent = _advanced(before.recent, new, seen, stays, RECENT)
            count = np.where(stays, np.minimum(seen + 1, most_frames), present).astype(new.dtype)
            frames, after = np.maximum(count, 1), (mean, recent, count)
    averaged = np.empty_like(moments)
    averaged.real, averaged.imag = mean
    return Still(averaged, MomentNoise(variance / frames), frames, *after)


def _advanced(mean: _Planes, new: _Planes, seen: _Planes, stays: Array, most: int) -> _Planes:
    """Return means with a new frame in them; the frame itself where a pixel does not stay.

    With the weight 2 / (most + 1) the variance stays 1 / most.
    """
    share = np.where(seen < most, 1 / (seen + 1), 2 / (most + 1)).astype(new.dtype)
    following = new - mean
    following *= share
    following += mean
    np.copyto(following, new, where=~stays)
    return following


def _changed(
    new: _Planes, before: Still, weight: _Planes, order: NDArray[np.int_], among: Array
) -> Array:
    """Return which pixels differ from their means by more than noise, or have drifted."""
    mean, seen, j = before.mean, np.maximum(before.seen, 1), order.astype(new.dtype)[:, None, None]
    numbers = int(((weight.max(axis=(1, 2)) > 0) * np.where(order > 0, 2, 1)).sum())
    shifts = np.zeros((4, *among.shape), new.dtype)  # later and brighter: the frame, the last ones
    size = weight * (mean[0] * mean[0] + mean[1] * mean[1])
    brightness, depth = size.sum(axis=0), (j * j * size).sum(axis=0)
    lit = among & (brightness * seen > LIT**2)
    drifting = among & (seen > RECENT)
    # one over the variance of a difference, over that of a frame
    of_recent = np.where(drifting, RECENT * seen / np.maximum(seen - RECENT, 1), 0)
    found, near = np.zeros((2, *among.shape), dtype=bool)
    differences = [(new, seen / (seen + 1), CHANGED)]
    if drifting.any():
        differences.append((before.recent, of_recent, DRIFTED))
    for at, (other, known, limit) in enumerate(differences):
        off = other - mean
        off[1, order == 0] = 0
        scaled = weight * off
        misfit = known * (scaled * off).sum(axis=(0, 1))
        later = (j * (scaled[1] * mean[0] - scaled[0] * mean[1])).sum(axis=0)
        more = (scaled * mean).sum(axis=(0, 1))
        if at == 0:  # the noise of the mean is in both factors; of recent frames it cancels
            more += numbers / seen
        later, more = later * np.sqrt(known / depth), more * np.sqrt(known / brightness)
        both = shifts[2 * at : 2 * at + 2]
        both[0], both[1] = np.where(among, later, 0), np.where(lit, more, 0)
        most = abs(both).max(axis=0)
        found |= ~((misfit <= _quantile(numbers, limit)) & (most <= limit))
        near |= (misfit > _quantile(numbers, DOUBTFUL)) | (most > DOUBTFUL)
    both = np.concatenate([shifts, shifts != 0])  # of deviations; how many
    for step in (1, 3):  # 3 x 3 pixels, then 3 x 3 of these; what has changed is not among them
        both = _summed(np.where(found, 0, both), step)
        found |= (both[:4] ** 2 > DRIFTED**2 * np.maximum(both[4:], 1)).any(axis=0)
    found &= among
    found |= near & (_summed(found.astype(np.int8), 1) >= BESIDE)
    return found | (_summed(found.astype(np.int8), 1) >= AMIDST)


@lru_cache(maxsize=64)
def _quantile(numbers: int, deviations: float) -> float:
    """Return what chi-square exceeds as rarely as a normal variable so many deviations.

    By Wilson and Hilferty (1931); the normal variable counts on both sides.
    """
    part = 2 / (9 * max(numbers, 1))
    normal = NormalDist().inv_cdf(1 - math.erfc(deviations / math.sqrt(2)))
    return numbers * float(1 - part + normal * math.sqrt(part)) ** 3


def _summed(planes: _Planes, step: int) -> _Planes:
    """Return sums over 3 x 3 pixels (..., H, W), so many apart; 0 is beyond the border."""
    rows = planes.copy()
    rows[..., step:, :] += planes[..., :-step, :]
    rows[..., :-step, :] += planes[..., step:, :]
    sums = rows.copy()
    sums[..., step:] += rows[..., :-step]
    sums[..., :-step] += rows[..., step:]
    return sums
