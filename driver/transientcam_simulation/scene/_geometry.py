"""Shapes in space: hits of rays, reflection in mirrors, shadows.

Lengths in m; x points right, y away from the camera, z up.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]  # (..., 3)
Values = NDArray[np.float64]
Bilinear = tuple[NDArray[np.intp], NDArray[np.float64]]  # (P, 4) cells, (P, 4) their weights
_SIGNS = np.array(
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
)  # of corners, around a front
_CLEAR = 1e-9  # fraction of a segment that counts as its end
_CLEAR_OF_CURVED = 1e-6  # the same where a root of a quadratic says where the segment starts


def rotation(angles_deg: Points) -> Points:
    """Return the matrix (3, 3) of a turn about x, then y, then z."""
    turn = np.eye(3)
    for axis, angle_rad in zip(np.eye(3), np.radians(angles_deg), strict=True):
        cross = np.cross(axis, np.eye(3)).T  # Rodrigues' formula
        about = np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross
        turn = turn + about @ turn
    return turn


@dataclass(frozen=True, slots=True)
class Cells:
    """A shape cut into a grid of flat patches, row by row.

    ``up`` (rows + 1) and ``along`` (columns + 1) are where it is cut, rising from -1 to 1: over
    height and width, or height and longitude. ``corners`` (N, 4, 3) run counter-clockwise as seen
    from the front.
    """

    up: Values
    along: Values
    centre: Points
    normal: Points
    corners: Points

    @property
    def rows(self) -> int:
        """From the lowest one."""
        return len(self.up) - 1

    @property
    def columns(self) -> int:
        """From the left."""
        return len(self.along) - 1


@dataclass(frozen=True)
class Rectangle:
    """A flat rectangle with a front.

    ``right`` and ``up`` are unit vectors seen from the front, ``normal`` points out of it.
    """

    centre: Points
    normal: Points
    right: Points
    up: Points
    width: float
    height: float

    @classmethod
    def facing(cls, centre: Points, normal: Points, *, size: tuple[float, float]) -> "Rectangle":
        """Stand upright and face along ``normal``; the upper side of a lying one is at +y."""
        normal = normal / np.linalg.norm(normal)
        vertical = np.array([0.0, 0.0, 1.0])
        if abs(normal @ vertical) > 1 - 1e-6:
            vertical = np.array([0.0, 1.0, 0.0])
        # seen from the front, the viewer looks along -normal: right = up x normal
        right = np.cross(vertical, normal)
        right /= np.linalg.norm(right)
        return cls(centre, normal, right, np.cross(normal, right), *size)

    def mirrored(self, points: Points) -> Points:
        """Image points: reflect points in the rectangle's plane."""
        distance = (points - self.centre) @ self.normal
        image: Points = points - 2 * distance[..., None] * self.normal
        return image

    def mirrored_direction(self, direction: Points) -> Points:
        """Reflect directions in the rectangle's plane."""
        reflected: Points = direction - 2 * (direction @ self.normal)[..., None] * self.normal
        return reflected

    @cached_property
    def box(self) -> tuple[Points, Points]:
        """Lowest and highest coordinates."""
        corners = self.extent()
        return corners.min(axis=0), corners.max(axis=0)

    def moved(self, by: Points) -> "Rectangle":
        """Return it moved."""
        return replace(self, centre=self.centre + by)

    def turned_by(self, turn: Points) -> "Rectangle":
        """Return it turned by a matrix (3, 3) about its centre."""
        return replace(self, normal=turn @ self.normal, right=turn @ self.right, up=turn @ self.up)

    def turned(self) -> "Rectangle":
        """Return it with its front where its back is."""
        return replace(self, normal=-self.normal, right=-self.right)

    def normals(self, points: Points) -> Points:
        """Return unit normals at points on it."""
        return np.broadcast_to(self.normal, points.shape)

    def extent(self) -> Points:
        """Return points (N, 3) whose convex hull holds it."""
        return self.at(*_SIGNS.T)

    def tangents(self, apex: Points, middle: Points, across: Points) -> tuple[float, float]:
        """Lowest and highest tangent of its points' angles at an apex to a direction.

        In the plane of the direction and of one across it, both unit vectors. Infinite where it
        reaches behind the apex.
        """
        away = self.extent() - apex
        along = away @ middle
        if along.min() <= _CLEAR:
            return -np.inf, np.inf
        tangents = away @ across / along
        return float(tangents.min()), float(tangents.max())

    def grid(self, edge_m: float) -> tuple[int, int]:
        """Return how many rows and columns of such patches it has."""
        return _counts(self.height, edge_m), _counts(self.width, edge_m)

    def at(self, x: Values, y: Values) -> Points:
        """Points at places over width and height, from -1 to 1."""
        across, upwards = self.right * self.width / 2, self.up * self.height / 2
        return self.centre + x[..., None] * across + y[..., None] * upwards

    def between_cells(self, points: Points, cells: Cells) -> Bilinear:
        """Interpolate between the cells' centres, and go on in a straight line beyond them."""
        offset = points - self.centre
        columns = cells.columns
        row, below = _place(offset @ self.up / (self.height / 2), _middles(cells.up))
        column, left = _place(offset @ self.right / (self.width / 2), _middles(cells.along))
        next_row = np.minimum(row + 1, cells.rows - 1)
        next_column = np.minimum(column + 1, columns - 1)
        return _bilinear(row, below, next_row, column, left, next_column, columns)

    def in_front(self, points: Points) -> NDArray[np.bool_]:
        """Which points lie on the side the rectangle faces."""
        front: NDArray[np.bool_] = (points - self.centre) @ self.normal > 0
        return front

    def crossing(
        self, start: Points, end: Points
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Where the lines from ``start`` to ``end`` cross the plane.

        Returns the fraction of the way (NaN for parallel lines) and the coordinates on the
        rectangle from -1 to 1 (left to right, bottom to top).
        """
        way = end - start
        along = way @ self.normal
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = ((self.centre - start) @ self.normal) / np.where(along == 0, np.nan, along)
        offset = start + fraction[..., None] * way - self.centre
        return (
            fraction,
            offset @ self.right / (self.width / 2),
            offset @ self.up / (self.height / 2),
        )

    def hit(self, start: Points, end: Points) -> NDArray[np.float64]:
        """Fraction of the way at which segments hit the rectangle; infinity where they miss."""
        before = (start - self.centre) @ self.normal
        after = (end - self.centre) @ self.normal
        at = np.full(before.shape, np.inf)
        crosses = before * after <= 0  # of all segments, few pass the plane
        if crosses.any():
            fraction, x, y = self.crossing(start[crosses], end[crosses])
            inside = (np.abs(x) <= 1) & (np.abs(y) <= 1) & (fraction > _CLEAR)
            at[crosses] = np.where(inside, fraction, np.inf)
        return at


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid whose axes are those of space, seen from outside."""

    centre: Points
    radii: Points

    @cached_property
    def box(self) -> tuple[Points, Points]:
        """Lowest and highest coordinates."""
        return self.centre - self.radii, self.centre + self.radii

    def moved(self, by: Points) -> "Ellipsoid":
        """Return it moved."""
        return replace(self, centre=self.centre + by)

    def normals(self, points: Points) -> Points:
        """Return unit normals at points on it."""
        gradient = (points - self.centre) / self.radii**2
        normals: Points = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return normals

    def extent(self) -> Points:
        """Return points (N, 3) whose convex hull holds it: the corners of its box."""
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return self.centre + signs * self.radii

    def in_front(self, points: Points) -> NDArray[np.bool_]:
        """Which points lie outside."""
        outside: NDArray[np.bool_] = (((points - self.centre) / self.radii) ** 2).sum(-1) > 1
        return outside

    def hit(self, start: Points, end: Points) -> NDArray[np.float64]:
        """Fraction of the way at which segments enter or leave it; infinity where they miss."""
        # |origin + fraction way| = 1, one coordinate after the other
        origins = [(start[..., k] - self.centre[k]) / self.radii[k] for k in range(3)]
        ways = [(end[..., k] - start[..., k]) / self.radii[k] for k in range(3)]
        a = ways[0] * ways[0] + ways[1] * ways[1] + ways[2] * ways[2]
        b = origins[0] * ways[0] + origins[1] * ways[1] + origins[2] * ways[2]
        c = origins[0] * origins[0] + origins[1] * origins[1] + origins[2] * origins[2] - 1
        discriminant = b * b - a * c
        at = np.full(discriminant.shape, np.inf)
        met = discriminant > 0
        if met.any():
            a, b, root = a[met], b[met], np.sqrt(discriminant[met])
            first, second = (-b - root) / a, (-b + root) / a
            ahead = np.where(first > _CLEAR_OF_CURVED, first, second)
            at[met] = np.where(ahead > _CLEAR_OF_CURVED, ahead, np.inf)
        return at

    def grid(self, edge_m: float) -> tuple[int, int]:
        """Return how many rows and columns of such patches it has."""
        rows = max(2, _counts(np.pi * float(self.radii[2]), edge_m))
        return rows, max(4, _counts(2 * np.pi * float(self.radii[:2].max()), edge_m))

    def at(self, x: Values, y: Values) -> Points:
        """Points at places over longitude, which starts at -x, and height, from -1 to 1."""
        across = np.sqrt(np.maximum(0.0, 1 - y * y))
        on_unit = np.stack([across * np.cos(np.pi * x), across * np.sin(np.pi * x), y], axis=-1)
        return self.centre + on_unit * self.radii

    def between_cells(self, points: Points, cells: Cells) -> Bilinear:
        """Interpolate between the cells' centres, around and up to the poles."""
        on_unit = (points - self.centre) / self.radii
        row, below = _place(np.clip(on_unit[..., 2], -1, 1), _middles(cells.up))
        below = np.clip(below, 0, 1)
        turn = np.arctan2(on_unit[..., 1], on_unit[..., 0]) / np.pi
        middles = _middles(cells.along)
        around, right = _place(turn, np.concatenate([middles[-1:] - 2, middles, middles[:1] + 2]))
        columns, next_row = cells.columns, np.minimum(row + 1, cells.rows - 1)
        return _bilinear(
            row, below, next_row, (around - 1) % columns, right, around % columns, columns
        )


Primitive = Rectangle | Ellipsoid


def cells_of(shape: Primitive, up: Values, along: Values) -> Cells:
    """Cut a shape into patches: see `Cells`."""
    (y, x), (high, wide) = (
        [each.ravel() for each in np.meshgrid(*pair, indexing="ij")]
        for pair in ((_middles(up), _middles(along)), (np.diff(up) / 2, np.diff(along) / 2))
    )
    around = x[:, None] + _SIGNS[:, 0] * wide[:, None], y[:, None] + _SIGNS[:, 1] * high[:, None]
    centre = shape.at(x, y)
    return Cells(up, along, centre, shape.normals(centre), shape.at(*around))


def _counts(length_m: float, edge_m: float) -> int:
    return max(1, round(length_m / edge_m))


def evenly(count: int) -> Values:
    """Cuts from -1 to 1 into so many equal parts."""
    return np.linspace(-1.0, 1.0, count + 1)


def _middles(cuts: Values) -> Values:
    middles: Values = (cuts[1:] + cuts[:-1]) / 2
    return middles


def _place(coordinate: Values, middles: Values) -> tuple[NDArray[np.intp], Values]:
    """Find the middle below a coordinate, and how far on the way to the next."""
    last = len(middles) - 2
    if last < 0:
        return np.zeros(coordinate.shape, dtype=np.intp), np.zeros_like(coordinate)
    cell = np.clip(np.searchsorted(middles, coordinate, "right") - 1, 0, last)
    return cell, (coordinate - middles[cell]) / (middles[cell + 1] - middles[cell])


def _bilinear(
    row: NDArray[np.intp], up: NDArray[np.float64], next_row: NDArray[np.intp],
    column: NDArray[np.intp], right: NDArray[np.float64], next_column: NDArray[np.intp],
    columns: int,
) -> Bilinear:  # fmt: skip
    cells = [
        row * columns + column,
        row * columns + next_column,
        next_row * columns + column,
        next_row * columns + next_column,
    ]
    weights = [(1 - up) * (1 - right), (1 - up) * right, up * (1 - right), up * right]
    return np.stack(cells, axis=-1), np.stack(weights, axis=-1)


def blocked_by_mask(
    rectangle: Rectangle, opaque: NDArray[np.bool_], start: Points, end: Points
) -> NDArray[np.bool_]:
    """Which segments end on an opaque cell of a mask spread over the rectangle.

    Rows of the mask run from top to bottom, columns from left to right as seen from the front.
    """
    fraction, x, y = rectangle.crossing(start, end)
    between = (fraction > _CLEAR) & (fraction < 1 - _CLEAR) & (np.abs(x) < 1) & (np.abs(y) < 1)
    rows, columns = opaque.shape
    column = ((np.where(between, x, 0.0) + 1) / 2 * columns).astype(int)
    row = ((1 - np.where(between, y, 0.0)) / 2 * rows).astype(int)
    blocked: NDArray[np.bool_] = between & opaque[row, column]
    return blocked
