"""Which share of each pixel a shape covers, seen from one point, without further rays.

Lines through one apex are tested against a shape. What is computed of each line changes its sign at
the silhouette and is smooth across it, so that its differences between neighbouring pixels say how
far the silhouette is from the pixel's centre.

Functions of planes that have no branches are also compiled, for one number at a time: see
`compiled_numbers`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.scene import Ellipsoid, Points, Primitive, Rectangle

Plane = NDArray[np.float32]
Values: TypeAlias = NDArray[Any]
"""Of a plane, whose type NumPy's stubs lose in arithmetic."""
Ball: TypeAlias = tuple[np.float32, ...]
"""1 / radii, origin of lines over the radii, 1 - its square, and what keeps from dividing by 0."""
Plate: TypeAlias = Sequence[Sequence[np.float32]] | Plane
"""(3, 5) axes (normal, right, up), places along them, and the rest that `on_rectangle` needs."""
TOUCHING = np.float32(1e-4)
"""Of the way from the apex: what is so close to a point touches it."""
ZERO, ONE, TWO = np.float32(0), np.float32(1), np.float32(2)
LEAST = np.float32(1e-9)
_TINY = np.float32(1e-12)
_GENTLEST = np.float32(1e-2)
_MEAN_BEND = np.float32(24)


@dataclass(frozen=True, slots=True)
class Crossing:
    """Lines ``apex + t way`` and a shape.

    ``inside``: functions of the line that are above 0 where it meets the shape, all of them.
    ``at``: the t at which it meets a rectangle's plane, or is closest to an ellipsoid's centre.
    """

    inside: tuple[Plane, ...]
    at: Plane

    def between(self, near: Plane, far: Plane) -> NDArray[np.bool_]:
        """Whether lines meet the shape between two of their points, and not just at one."""
        between: NDArray[np.bool_] = self.at > near + TOUCHING
        between &= self.at < far * (1 - TOUCHING)
        return between


def crossing(shape: Primitive, apex: Points, way: tuple[Plane, Plane, Plane]) -> Crossing:
    """Cross lines, given by three planes of their components, with a shape."""
    if isinstance(shape, Ellipsoid):
        inside, at, _squared = near_ellipsoid(ball_of(shape.centre, shape.radii, apex), *way)
        return Crossing((inside,), at)
    one, other, at, _facing = on_rectangle(plate_of(shape, apex), *way)
    return Crossing((one, other), at)


def ball_of(centre: Points, radii: Points, apex: Points) -> Ball:
    """Return what lines from an apex are crossed with, of an ellipsoid."""
    x = (apex[0] - centre[0]) / radii[0]
    y = (apex[1] - centre[1]) / radii[1]
    z = (apex[2] - centre[2]) / radii[2]
    return (
        np.float32(1 / radii[0]),
        np.float32(1 / radii[1]),
        np.float32(1 / radii[2]),
        np.float32(x),
        np.float32(y),
        np.float32(z),
        np.float32(1 - (x * x + y * y + z * z)),
        _TINY,
    )


def near_ellipsoid(ball: Ball, x: Values, y: Values, z: Values) -> tuple[Values, Values, Values]:
    """Return where lines (x, y, z) are closest to an ellipsoid's centre.

    1 minus the squared distance there, where the ellipsoid is a unit sphere; the t; and the squared
    length of (x, y, z) in that space.
    """
    x, y, z = x * ball[0], y * ball[1], z * ball[2]
    squared = x * x + y * y + z * z + ball[7]
    along = x * ball[3] + y * ball[4] + z * ball[5]
    closest = along / squared
    return along * closest + ball[6], -closest, squared


def plate_of(shape: Rectangle, apex: Points) -> Plane:
    """Return what lines from an apex are crossed with, of a rectangle: see `Plate`."""
    origin = apex - shape.centre
    plate = np.empty((3, 5), dtype=np.float32)
    plate[0, :3], plate[0, 3], plate[0, 4] = shape.normal, -(origin @ shape.normal), _TINY
    plate[1, :3], plate[1, 3], plate[1, 4] = shape.right, origin @ shape.right, 2 / shape.width
    plate[2, :3], plate[2, 3], plate[2, 4] = shape.up, origin @ shape.up, 2 / shape.height
    return plate


def on_rectangle(
    plate: Plate, x: Values, y: Values, z: Values
) -> tuple[Values, Values, Values, Values]:
    """Return where lines (x, y, z) meet a rectangle's plane.

    Functions that are above 0 within its width and its height; the t; and the lines' component
    along the normal.
    """
    normal, right, up = plate[0], plate[1], plate[2]
    tiny = normal[4]
    facing = x * normal[0] + y * normal[1] + z * normal[2]
    at = normal[3] / (facing + tiny)
    across = at * (x * right[0] + y * right[1] + z * right[2] + tiny) + right[3]
    along = at * (x * up[0] + y * up[1] + z * up[2] + tiny) + up[3]
    return ONE - np.abs(across) * right[4], ONE - np.abs(along) * up[4], at, facing


def single(values: NDArray[np.floating]) -> Plane:
    """Return them in single precision, which they are in already."""
    return values.astype(np.float32, copy=False)


def covered(inside: Plane) -> Plane:
    """Share of each pixel (H, W) where a function is above 0; NaN is nowhere.

    The function is taken as linear within a pixel, about its mean.
    """
    positive = inside > 0
    share = positive.astype(np.float32)
    near = np.flatnonzero(_at_border(positive))
    if near.size:
        flat = inside.ravel()
        beside = (flat[each] for each in _neighbours(inside.shape, near))
        share.ravel()[near] = at_border(flat[near], *beside)[0]
    return share


def at_border(
    value: Values, up: Values, down: Values, left: Values, right: Values
) -> tuple[Values, Values, Values, Values]:
    """Return the share of a pixel where a function is above 0, its mean over it, and its slopes.

    By the values at the pixel's centre and those of its neighbours.
    """
    along, bend = slope(value - up, down - value)
    across, more = slope(value - left, right - value)
    mean = value + (bend + more) / _MEAN_BEND
    share = half_plane(mean, np.maximum(along, across), np.minimum(along, across))
    return share, mean, along, across


def slope(before: Values, after: Values) -> tuple[Values, Values]:
    """Size of a slope and its change, given the differences to both neighbours.

    About an extremum, or beside pixels that have no value, it is the smaller difference.
    """
    even = before * after > ZERO
    smaller = np.fmin(np.abs(before), np.abs(after))
    smaller = select(np.isnan(smaller), ZERO, smaller)
    return select(even, np.abs(before + after) / TWO, smaller), select(even, after - before, ZERO)


def half_plane(value: Values, steep: Values, gentle: Values) -> Values:
    """Area of a unit square where ``value + steep x + gentle y`` is above 0, about its centre."""
    steep = np.maximum(steep, LEAST)
    gentle = np.maximum(gentle, _GENTLEST * steep)
    half, rest = (steep + gentle) / TWO, (steep - gentle) / TWO
    # the integral of the step over the square: second differences of a parabola
    a, b = np.maximum(value + half, ZERO), np.maximum(value + rest, ZERO)
    c, d = np.maximum(value - rest, ZERO), np.maximum(value - half, ZERO)
    area = a * a - b * b - c * c + d * d
    share = np.minimum(np.maximum(area / (TWO * steep * gentle), ZERO), ONE)
    # from where on nothing is left of the differences but rounding; and NaN is nowhere
    return select(value >= half, ONE, select(np.isnan(value), ZERO, share))


def select(
    condition: NDArray[np.bool_], one: Values | np.float32, other: Values | np.float32
) -> Values:
    """Return one number where a condition holds, and else the other."""
    return np.where(condition, one, other)


def _at_border(positive: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels with a neighbour on the other side: a border crosses no others."""
    border = np.zeros_like(positive)
    step = positive[1:] != positive[:-1]
    border[1:] |= step
    border[:-1] |= step
    step = positive[:, 1:] != positive[:, :-1]
    border[:, 1:] |= step
    border[:, :-1] |= step
    return border


def _neighbours(shape: tuple[int, ...], at: NDArray[np.intp]) -> tuple[NDArray[np.intp], ...]:
    """Return the pixels above, below, left and right of some pixels, by index.

    Beyond the edge, the neighbour on the other side stands for the one that is not there.
    """
    height, width = shape
    row, column = np.divmod(at, width)
    return (
        np.where(row > 0, at - width, at + width * (height > 1)),
        np.where(row < height - 1, at + width, at - width * (height > 1)),
        np.where(column > 0, at - 1, at + (width > 1)),
        np.where(column < width - 1, at + 1, at - (width > 1)),
    )
