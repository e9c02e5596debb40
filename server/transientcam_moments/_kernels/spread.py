"""Parts of an image for several threads: kernels release the interpreter while they run."""

import itertools
from collections.abc import Callable
from concurrent.futures import Executor

Part = Callable[[int, int], None]
"""Works on the pixels from its first argument up to its second."""

Spread = Callable[[Part, int], None]
"""Has all pixels of an image worked on, by one call of the part or by several at a time."""

_UNIT = 1024  # parts begin at multiples of it, and none is smaller than it


def at_once(part: Part, pixels: int) -> None:
    """Do all pixels on the calling thread."""
    part(0, pixels)


def over(executor: Executor, parts: int) -> Spread:
    """Return a way to do an image in up to ``parts`` parts, on the threads of an executor.

    The calling thread does the first part itself and waits for the others.
    """

    def spread(part: Part, pixels: int) -> None:
        size = max(_UNIT, -(-pixels // (parts * _UNIT)) * _UNIT)
        cuts = [0, *range(size, pixels - _UNIT + 1, size), pixels]
        futures = [executor.submit(part, *pair) for pair in itertools.pairwise(cuts[1:])]
        part(cuts[0], cuts[1])
        for future in futures:
            future.result()

    return spread
