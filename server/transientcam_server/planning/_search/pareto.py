"""What no other point beats in cost and error."""

import math
from collections.abc import Callable, Iterable
from typing import Final, TypeVar

_T = TypeVar("_T")
LITTLE: Final = 2.0
"""More time buys little where it leaves more than one over this of the error."""


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


def flat_from(errors: list[tuple[float, float, float]]) -> int | None:
    """Return the first place of a front from which on bias rules and more time buys little.

    Parameters
    ----------
    errors
        Noise, bias, and both together, by rising time.

    Returns
    -------
    int or None
        None where noise rules the last one.
    """
    place = None
    for k in reversed(range(len(errors))):
        noise, bias, error = errors[k]
        if bias <= noise or error > LITTLE * errors[-1][2]:
            break
        place = k
    return place
