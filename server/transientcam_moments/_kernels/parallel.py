"""Parts of an image for several threads: kernels release the interpreter while they run."""

import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from typing import Protocol

_BLOCK = 1 << 14

Part = Callable[[int, int], None]
"""Works on the pixels (or rows) from its first argument up to its second."""


class Spread(Protocol):
    """Has ``total`` pixels worked on, in parts that begin at multiples of ``unit``."""

    def __call__(self, part: Part, total: int, /, unit: int = 1024) -> None:
        """Return when all parts are done."""


def at_once(part: Part, total: int, /, unit: int = 1024) -> None:
    """Do everything in one part, on the calling thread."""
    part(0, total)


def over(executor: Executor, parts: int) -> Spread:
    """Return a way to do an image in up to ``parts`` parts, on the threads of an executor.

    The calling thread does the first part itself and waits for the others. No part is smaller
    than a unit.
    """

    def spread(part: Part, total: int, /, unit: int = 1024) -> None:
        size = max(unit, -(-total // (parts * unit)) * unit)
        cuts = [0, *range(size, total - unit + 1, size), total]
        futures = [executor.submit(part, *pair) for pair in itertools.pairwise(cuts[1:])]
        part(cuts[0], cuts[1])
        for future in futures:
            future.result()

    return spread


def blocks(start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Cut pixels into blocks that stay in the second cache from one kernel to the next."""
    cuts = [*range(start, max(start + 1, stop - _BLOCK // 2), _BLOCK), stop]
    return itertools.pairwise(cuts)
