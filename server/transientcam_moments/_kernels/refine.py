"""What lanes cannot do safely: a few pixels, with more digits or by the planar statement."""

from typing import Any, NamedTuple

import numpy as np

from transientcam_moments._kernels.arrays import Complexes, Places
from transientcam_moments.arrays import in_turn
from transientcam_moments.moment_problem import polish


class Found(NamedTuple):
    """Returns of all pixels in single precision, flat; their residual says which are wrong.

    Without ``uniform`` the uniform part stays as it is.
    """

    uniform: Any | None
    phase: Any
    weight: Any
    count: Any
    residual: Any


def redo(planes: Complexes, found: tuple[Any, ...], ill: Places, noise: float) -> None:
    """Redo pixels whose returns don't reproduce their moments, with more digits or more care.

    Parameters
    ----------
    planes : array, shape (m + 1, P)
        Moments in double precision.
    found : tuple of array
        Phase, weight, uniform, count; written to.
    ill : integer array
        The pixels.
    noise : float
        Precision of the data.
    """
    from transientcam_moments.moment_problem import first_returns, improved_returns

    part = planes[:, ill]
    found64 = first_returns(part, noise=noise)
    if noise == np.finfo(np.float64).eps:
        phase, weight, uniform, _ = improved_returns(part, found64)
    else:
        with np.errstate(all="ignore"):
            phase, weight, uniform = polish(part, *found64[:3], tolerance=4 * len(planes) * noise)
    weight = weight.astype(found[1].dtype)
    # what is less than the least number of that precision isn't a return
    phase = in_turn(np.where(weight > 0, phase, np.nan).astype(found[0].dtype))
    order = np.argsort(phase, axis=0)
    phase, weight = (np.take_along_axis(part, order, axis=0) for part in (phase, weight))
    better = (phase, weight, uniform, (weight > 0).sum(axis=0))
    for plane, new in zip(found, better, strict=True):
        plane[..., ill] = new
