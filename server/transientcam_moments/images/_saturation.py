"""Images at the end of their scale: what they would hold, where the other images tell it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array

_KNOWN = 1e-9  # of a sum of squared weights, or of a ratio of singular values, that is not rounding


class Recovered(NamedTuple):
    """Images of a capture of which some were at the end of their scale.

    Attributes
    ----------
    images : array, shape (takes, N, ...)
        float32, or float64 for such images; what is recovered is in its place.
    saturated : boolean array, shape (...)
        Pixels with an image at the end of its scale.
    undetermined : boolean array, shape (...)
        Those of them whose other images leave open what the saturated ones hold.
    variance : array, shape (...)
        Of a pixel's moments, over that of images of which none is saturated, as that of an image
        grows with its light.
    """

    images: Array
    saturated: Array
    undetermined: Array
    variance: Array


class _Group(NamedTuple):
    """What the images of one frequency tell, of which some are saturated."""

    of_offset: Array
    weight: float
    prediction: Array
    determined: bool
    of_kept: Array
    of_offsets: float


def recover_saturated(
    takes: Array, first: int, phases_rad: Sequence[float], full_scale: float
) -> Recovered | None:
    """Replace images at the end of their scale by what the other images of the pixel imply.

    Parameters
    ----------
    takes : array, shape (takes, N, ...)
        Raw images in capture order.
    first : int
        How many images of a take come before those at the phases; one of these that is saturated
        is never recovered.
    phases_rad : sequence of float
        Of the images of each frequency.
    full_scale : float
        Largest value that the sensor gives.

    Returns
    -------
    Recovered or None
        None where no image is at the end of its scale, and where one is beyond it: then the scale
        is another one, and nothing is known of its end.

    Notes
    -----
    Image k of frequency j holds o + 1/2 Re(b_j exp(-i phase_k)), and o = dark + ambient + b_0 / 2
    is the same at every frequency (Sec. 3.1). The images that are not saturated give o, and with it
    b_j as long as two of frequency j are left at phases that are not opposite, by least squares.
    What was cut off is at least the end of the scale.
    """
    if not takes.size or np.fmax.reduce(takes, axis=None) != full_scale:
        return None
    of_take = takes.shape[:2]
    flat = takes.reshape((*of_take, -1))
    saturated = (flat >= full_scale).any(axis=(0, 1))
    places = np.flatnonzero(saturated)
    real = np.float64 if takes.dtype == np.float64 else np.float32
    images = flat.astype(real)
    undetermined, variance = np.zeros(saturated.shape, dtype=bool), np.ones(saturated.shape, real)
    variance[places] = 0
    for take in images:
        values, lost, its = _filled(take[:, places].astype(float), first, phases_rad, full_scale)
        take[:, places] = values
        undetermined[places] |= lost
        variance[places] += its / len(images)
    of_pixels = (each.reshape(takes.shape[2:]) for each in (saturated, undetermined, variance))
    return Recovered(images.reshape(takes.shape), *of_pixels)


def _filled(
    values: Array, first: int, phases_rad: Sequence[float], full_scale: float
) -> tuple[Array, Array, Array]:
    """Return the images (N, P) of one take with what is implied, which pixels stay open, and how
    many times the variance of their moments is.
    """
    phases = len(phases_rad)
    over = values >= full_scale
    lost = over[:first].any(axis=0)
    grouped = values[first:].reshape((-1, phases, values.shape[1]))
    cut = over[first:].reshape(grouped.shape)
    codes = np.tensordot(1 << np.arange(phases), cut, axes=(0, 1))
    patterns, which = np.unique(codes, return_inverse=True)
    groups = [_group(phases_rad, (pattern >> np.arange(phases)) & 1 == 0) for pattern in patterns]
    which = which.reshape(codes.shape)
    kept = np.where(cut, 0.0, grouped)
    weights = np.stack([group.of_offset for group in groups])[which]  # (F, P, phases)
    known = np.array([group.weight for group in groups])[which].sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.einsum("fpk,fkp->p", weights, kept) / known
    lost = lost | ~(known > _KNOWN)
    lost = lost | ~np.array([group.determined for group in groups])[which].all(axis=0)
    predictions = np.stack([group.prediction for group in groups])[which]  # (F, P, phases, phases)
    implied = offset + np.einsum("fpkl,flp->fkp", predictions, np.where(cut, 0.0, grouped - offset))
    found = np.where(cut & ~lost, np.maximum(implied, full_scale), grouped)
    light = np.maximum(found, 0.0)
    own = np.einsum("fpk,fkp->p", np.stack([group.of_kept for group in groups])[which], light)
    through = np.array([group.of_offsets for group in groups])[which].sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_offset = np.einsum("fpk,fkp->p", weights**2, light) / known**2
        times = np.where(lost, 1.0, (own + through * of_offset) / light.sum(axis=(0, 1)))
    return np.concatenate([values[:first], found.reshape(values[first:].shape)]), lost, times


def _group(phases_rad: Sequence[float], kept: Array) -> _Group:
    """Return what the images of one frequency tell of the offset, and of those that are not kept.

    ``of_offset`` (phases,) is the part of the constant that cosine and sine of the kept images
    cannot be taken for, and ``weight`` its square; ``prediction`` (phases, phases) makes all images
    of the kept ones, both less the offset. ``of_kept`` (phases,) and ``of_offsets`` are squares of
    what kept images and the offset have in the moment, of which each has 1 where none is saturated.
    """
    phase = np.asarray(phases_rad, dtype=float)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    seen = waves * kept[:, None]
    inverse = np.linalg.pinv(seen, rcond=_KNOWN)
    left = np.where(kept, 1.0 - seen @ (inverse @ kept), 0.0)
    size = np.linalg.svd(seen, compute_uv=False)
    determined = bool(kept.all() or size[-1] > _KNOWN * max(1.0, size[0]))
    prediction = waves @ inverse
    filled = np.where(kept, 0.0, np.exp(1j * phase))
    own = np.where(kept, np.exp(1j * phase) + filled @ prediction, 0.0)
    of_offset = filled.sum() - filled @ prediction @ kept
    squares = np.abs(own) ** 2, float(np.abs(of_offset) ** 2)
    return _Group(left, float(left @ left), prediction, determined, *squares)
