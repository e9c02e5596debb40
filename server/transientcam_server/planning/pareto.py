"""The Pareto front: points that no other beats in both cost and error."""

import math
from collections.abc import Callable, Iterable
from typing import TypeVar

_T = TypeVar("_T")


def front(
    points: Iterable[_T], *, cost: Callable[[_T], float], error: Callable[[_T], float]
) -> list[_T]:
    """Return the points on the front, by rising cost and falling error.

    Of points with the same cost and error the first one stays; points of which either is not
    finite are on no front.
    """
    known = [
        point for point in points if math.isfinite(cost(point)) and math.isfinite(error(point))
    ]
    best, chosen = math.inf, []
    for point in sorted(known, key=lambda point: (cost(point), error(point))):
        if error(point) < best:
            best = error(point)
            chosen.append(point)
    return chosen
