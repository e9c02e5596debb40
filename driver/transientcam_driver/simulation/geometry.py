"""Rectangles in space: what rays hit, what mirrors reflect, what casts shadows.

Lengths in m; x points right, y away from the camera, z up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]  # (..., 3)
_CLEAR = 1e-9  # fraction of a segment that counts as its end


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
        fraction, x, y = self.crossing(start, end)
        inside = (np.abs(x) <= 1) & (np.abs(y) <= 1) & (fraction > _CLEAR)
        return np.where(inside, fraction, np.inf)


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
