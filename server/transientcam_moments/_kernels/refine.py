"""What lanes cannot do safely: a few pixels, with more digits or by the planar statement."""

from typing import Any

import numpy as np

from transientcam_moments._arrays import in_turn
from transientcam_moments._kernels.registry import LEAST_PIXELS, REGISTRY, Key
from transientcam_moments.polishing import polish


def redo(planes: Any, found: tuple[Any, ...], ill: Any, noise: float) -> None:
    """Redo pixels whose returns don't reproduce their moments, with more digits or more care.

    Parameters
    ----------
    planes : array, shape (m + 1, P)
        Moments.
    found : tuple of array
        Phase, weight, uniform, count; written to.
    ill : integer array
        The pixels.
    noise : float
        Precision of the data.
    """
    from transientcam_moments.pisarenko import _improved, _pisarenko

    part = planes[:, ill]
    lane = REGISTRY.compiled.get(Key("pisarenko", len(planes) - 1, "d"))
    if part.dtype == np.complex64 and lane is not None:
        enough = np.resize(np.arange(ill.size), max(ill.size, LEAST_PIXELS))
        better = lane(part[:, enough].astype(np.complex128), noise=noise)
        better = tuple(plane[..., : ill.size] for plane in better)
    elif part.dtype == np.complex64:
        better = _improved(part, tuple(plane[..., ill] for plane in found))
    else:
        better = _pisarenko(part, noise=noise)
        if noise == np.finfo(np.float64).eps:
            better = _improved(part, better)
    phase, weight, uniform, _ = better
    if noise > np.finfo(np.float64).eps:
        wide = part.astype(np.complex128)
        found64 = (each.astype(np.float64) for each in (phase, weight, uniform))
        with np.errstate(all="ignore"):
            phase, weight, uniform = polish(wide, *found64, tolerance=4 * len(planes) * noise)
    weight = weight.astype(found[1].dtype)
    # what is less than the least number of that precision isn't a return
    phase = in_turn(np.where(weight > 0, phase, np.nan).astype(found[0].dtype))
    order = np.argsort(phase, axis=0)
    phase, weight = (np.take_along_axis(part, order, axis=0) for part in (phase, weight))
    better = (phase, weight, uniform, (weight > 0).sum(axis=0))
    for plane, new in zip(found, better, strict=True):
        plane[..., ill] = new
