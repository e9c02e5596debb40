"""Pixels that something thin crosses, although lines through their centres may all miss it."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._bundle import Bundle
from transientcam_simulation.light._coverage import Plane, crossing
from transientcam_simulation.scene import Ellipsoid, Mesh, Points, Primitive, Shape

PIXELS = 2.0
"""Thinner than this between two sides counts as thin: others are met by some pixel's centre."""
_MAY_BE = 4.0  # pixels, up to which it is looked at: seen from a light, pixels have other sizes
_FAR_M = 1e3  # where surfaces are put that are not there


def may_be_thin(
    shape: Shape, apex: Points, pixel_rad: float, *, pixels: float = _MAY_BE, aslant: bool = True
) -> bool:
    """Whether a shape may be so thin, seen from a point; aslant: also where it shows its side.

    Of a mesh it is not known.
    """
    if isinstance(shape, Mesh):
        return False
    away_m = float(np.linalg.norm(shape.extent() - apex, axis=-1).max())
    if isinstance(shape, Ellipsoid):
        across_m = 2 * float(shape.radii.min())
    else:
        across_m = min(shape.width, shape.height)
        if aslant:
            across_m *= abs(float((apex - shape.centre) @ shape.normal)) / away_m
    return across_m < pixels * pixel_rad * away_m and away_m < _FAR_M


def crossed(shape: Primitive, bundle: Bundle, counts: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mark pixels (H, W) that a shape crosses where it is thin, seen along lines that count."""
    cross = crossing(shape, bundle.apex, bundle.way)
    found = counts & (cross.at > bundle.near) & (cross.at < bundle.far)
    thin = np.zeros(found.shape, dtype=bool)
    for inside in cross.inside:
        # from the middle of the shape, in halves of its width: linear but for a kink in the middle
        apart = np.maximum(1 - inside, 0)
        if isinstance(shape, Ellipsoid):
            apart = np.sqrt(apart)
        down, right = _step(apart), _step(apart.T).T
        found &= apart - (down + right) / 2 < 1
        thin |= np.maximum(down, right) > 2 / PIXELS
    return found & thin


def _step(values: Plane) -> Plane:
    """Return the larger difference of each value (H, W) from those above and below."""
    steps = np.abs(np.diff(values, axis=0))
    larger = np.zeros_like(values)
    larger[1:] = steps
    np.maximum(larger[:-1], steps, out=larger[:-1])
    return larger
