"""Which share of each pixel a shape covers, seen from one point, without further rays.

Lines through one apex are tested against a shape. What is computed of each line changes its sign at
the silhouette and is smooth across it, so that its differences between neighbouring pixels say how
far the silhouette is from the pixel's centre.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import LANES
from transientcam_simulation.scene import Ellipsoid, Points, Rectangle, Shape

Plane = NDArray[np.float32]
TOUCHING = np.float32(1e-4)
"""Of the way from the apex: what is so close to a point touches it."""
_TINY = np.float32(1e-12)


@dataclass(frozen=True, slots=True)
class Crossing:
    """Lines ``apex + t way`` and a shape.

    Attributes
    ----------
    inside
        Functions of the line that are above 0 where it meets the shape, all of them.
    at
        The t at which it meets a rectangle's plane, or is closest to an ellipsoid's centre.
    """

    inside: tuple[Plane, ...]
    at: Plane
    _length: Plane | None = None

    def between(self, near: Plane | np.float32, far: Plane | np.float32) -> NDArray[np.bool_]:
        """Whether lines meet the shape between two of their points, and not just at one."""
        between: NDArray[np.bool_] = self.at > near + TOUCHING
        between &= self.at < far * (1 - TOUCHING)
        return between

    def holds(self, t: float) -> NDArray[np.bool_]:
        """Whether the points at t are inside the shape, which rectangles have no inside for."""
        if self._length is None:
            return np.zeros(self.at.shape, dtype=bool)
        away = (self.at - np.float32(t)) * self._length
        within: NDArray[np.bool_] = away * away < self.inside[0]
        return within

    def entered(self, root: Plane) -> Plane:
        """Return the t at which lines enter, given the square root of ``inside`` for ellipsoids."""
        return self.at if self._length is None else single(self.at - root / self._length)


def crossing(shape: Shape, apex: Points, way: tuple[Plane, ...]) -> Crossing:
    """Cross lines, given by three planes of their components, with a shape."""
    if isinstance(shape, Ellipsoid):
        return _ellipsoid(shape, apex, way)
    return _rectangle(shape, apex, way)


def axes_of(shapes: Iterable[Shape]) -> NDArray[np.float64]:
    """Return (N, 2, 3) centres and radii of the ellipsoids among shapes."""
    axes = [(each.centre, each.radii) for each in shapes if isinstance(each, Ellipsoid)]
    return np.array(axes, dtype=np.float64).reshape(-1, 2, 3)


def ball_of(shape: Ellipsoid, apex: Points) -> Plane:
    """Return what lines from an apex are crossed with: 1 / radii, origin, 1 - its square, tiny."""
    origin = (apex - shape.centre) / shape.radii
    ball = np.empty(8, dtype=np.float32)
    x, y, z = origin
    squared = x * x + y * y + z * z  # a dot product's last digit depends on the machine's library
    ball[:3], ball[3:6], ball[6], ball[7] = 1 / shape.radii, origin, 1 - squared, _TINY
    return ball


def plate_of(shape: Rectangle, apex: Points) -> Plane:
    """Return (3, 5) axes (normal, right, up), places along them, tiny, and 2 over the sides."""
    origin = apex - shape.centre
    plate = np.empty((3, 5), dtype=np.float32)
    plate[0, :3], plate[0, 3], plate[0, 4] = shape.normal, -(origin @ shape.normal), _TINY
    plate[1, :3], plate[1, 3], plate[1, 4] = shape.right, origin @ shape.right, 2 / shape.width
    plate[2, :3], plate[2, 3], plate[2, 4] = shape.up, origin @ shape.up, 2 / shape.height
    return plate


def _ellipsoid(shape: Ellipsoid, apex: Points, way: tuple[Plane, ...]) -> Crossing:
    ball = ball_of(shape, apex)
    x, y, z = (w * scale for w, scale in zip(way, ball[:3], strict=True))
    squared = single(x * x)
    squared += y * y
    squared += z * z
    squared += _TINY
    along: Plane = x * ball[3]
    along += y * ball[4]
    along += z * ball[5]
    closest = single(along / squared)
    # 1 minus the squared distance of the line from the centre, where the ellipsoid is a unit sphere
    inside: Plane = along * closest
    inside += ball[6]
    np.negative(closest, out=closest)
    return Crossing((inside,), closest, np.sqrt(squared))


def _rectangle(shape: Rectangle, apex: Points, way: tuple[Plane, ...]) -> Crossing:
    normal, *sides = plate_of(shape, apex)

    def part(axis: Plane) -> Plane:
        x, y, z = (w * a for w, a in zip(way, axis, strict=False))
        return single(x + y + z + _TINY)

    at = single(normal[3] / part(normal))
    inside: list[Plane] = []
    for axis in sides:
        place = at * part(axis)
        place += axis[3]
        inside.append(1 - np.abs(place) * axis[4])
    return Crossing(tuple(inside), at)


def single(values: NDArray[np.floating]) -> Plane:
    """Return them in single precision, which they are in already."""
    return values.astype(np.float32, copy=False)


def covered(inside: Plane, *, rooted: bool = True) -> tuple[Plane, Plane]:
    """Share of each pixel (H, W) where a function is above 0, and its mean square root there.

    The function is taken as linear within a pixel, about its mean; NaN is nowhere. Without
    ``rooted`` the second plane is the first.
    """
    positive = inside > 0
    share = positive.astype(np.float32)
    root = np.sqrt(np.maximum(inside, np.float32(0))) if rooted else share
    near = np.flatnonzero(_at_border(positive))
    if near.size:
        flat = inside.ravel()
        beside = tuple((flat[to], flat[of]) for to, of in _neighbours(inside.shape, near))
        part, mean = _at(flat[near], beside, rooted=rooted)
        share.ravel()[near] = part
        if rooted:
            root.ravel()[near] = mean
    return share, root


def covered_among(inside: Plane, around: NDArray[np.int32]) -> Plane:
    """Share of each of some pixels (P) where a function is above 0; NaN is nowhere.

    ``around`` (4, P) are the pixels above, below, left and right of each, by index; P is none.
    """
    values = np.append(inside, np.float32(np.nan))
    positive = values > 0
    share = positive[:-1].astype(np.float32)
    near = np.flatnonzero((positive[around] != positive[:-1]).any(axis=0))
    if near.size:
        up, down, left, right = values[around[:, near]]
        share[near] = _at(values[near], ((up, down), (left, right)), rooted=False)[0]
    return share


def _at(
    value: Plane, beside: tuple[tuple[Plane, Plane], ...], *, rooted: bool
) -> tuple[Plane, Plane]:
    """Share of pixels at a border, and the mean root, by the values on both sides of each."""
    (down, bend), (right, more) = (_slope(value - one, other - value) for one, other in beside)
    value = single(value + (bend + more) / 24)  # its mean over the pixel
    share = _half_plane(value, np.maximum(down, right), np.minimum(down, right))
    if not rooted:
        return share, share
    width = np.sqrt(down * down + right * right)
    high = np.maximum(value + width / 2, np.float32(1e-9))
    low = np.maximum(value - width / 2, np.float32(0))
    cubes = high * np.sqrt(high) - low * np.sqrt(low)
    return share, single(cubes / np.maximum(1.5 * (high - low), np.float32(1e-9)))


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


def overlapped(one: Plane, other: Plane) -> Plane:
    """Share of each pixel (H, W) that lies in both of two shapes, given the share in either.

    Two borders in one pixel are mostly nearly parallel, as of a surface and of its own shadow: the
    shares then overlap as far as they can, or not at all if the borders face each other. Across
    each other they overlap by their product.
    """
    lane = LANES.find("overlapped")
    if lane is not None:
        shared: Plane = lane(one, other)
        return shared
    both = one * other
    at = np.flatnonzero((one > 0) & (one < 1) & (other > 0) & (other < 1))
    if not at.size:
        return both
    neighbours = _neighbours(one.shape, at)
    slopes = [[p.ravel()[to] - p.ravel()[of] for of, to in neighbours] for p in (one, other)]
    (x, y), (u, v) = slopes
    size = np.sqrt((x * x + y * y) * (u * u + v * v))
    cosine = (x * u + y * v) / np.maximum(size, np.float32(1e-9))
    first, second = one.ravel()[at], other.ravel()[at]
    across = first * second
    along = np.where(cosine > 0, np.minimum(first, second), np.maximum(first + second - 1, 0))
    both.ravel()[at] = across + cosine * cosine * (along - across)
    return both


_Pairs = tuple[tuple[NDArray[np.intp], NDArray[np.intp]], tuple[NDArray[np.intp], NDArray[np.intp]]]


def _neighbours(shape: tuple[int, ...], at: NDArray[np.intp]) -> _Pairs:
    """Return the pixels above and below, and left and right, of some pixels, by index.

    Beyond the edge, the neighbour on the other side stands for the one that is not there.
    """
    height, width = shape
    row, column = np.divmod(at, width)
    up = np.where(row > 0, at - width, at + width * (height > 1))
    down = np.where(row < height - 1, at + width, at - width * (height > 1))
    left = np.where(column > 0, at - 1, at + (width > 1))
    right = np.where(column < width - 1, at + 1, at - (width > 1))
    return (up, down), (left, right)


def _slope(before: Plane, after: Plane) -> tuple[Plane, Plane]:
    """Size of a slope and its change, given the differences to both neighbours.

    About an extremum, or beside pixels that have no value, it is the smaller difference.
    """
    even = before * after > 0
    smaller = np.fmin(np.abs(before), np.abs(after))
    slope = np.where(even, np.abs(before + after) / 2, smaller)
    slope[np.isnan(slope)] = 0
    return slope, np.where(even, after - before, np.float32(0))


def _half_plane(value: Plane, steep: Plane, gentle: Plane) -> Plane:
    """Area of a unit square where ``value + steep x + gentle y`` is above 0, about its centre."""
    steep = np.maximum(steep, np.float32(1e-9))
    gentle = np.maximum(gentle, np.float32(1e-2) * steep)
    area = np.zeros_like(value)
    half, rest = (steep + gentle) / 2, (steep - gentle) / 2
    # the integral of the step over the square: second differences of a parabola
    for sign, offset in ((1, half), (-1, rest), (-1, -rest), (1, -half)):
        part = np.maximum(value + offset, np.float32(0))
        area += sign * part * part
    share = single(np.clip(area / (2 * steep * gentle), 0, 1))
    share[value >= half] = 1  # where nothing is left of the differences but rounding
    share[np.isnan(share)] = 0
    return share
