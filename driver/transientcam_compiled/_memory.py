"""Memory for the results of kernels, used again once no array refers to it.

The system clears a page of 4 KiB whenever fresh memory is first written, which takes ten times as
long as writing it. The results of a frame of 640 x 480 pixels and m = 4 take 54 MB.
"""

import math
import threading
from collections import deque
from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

LEAST_BYTES: Final = 1 << 16
"""Smaller arrays are made afresh: the allocator has their memory at hand."""
PAGE_BYTES: Final = 4096
"""The smallest page of any system."""
MOST_BYTES: Final = 96 << 20
"""What is kept between frames: the results of one frame of 640 x 480 pixels and m = 8."""


class Pool:
    """Memory that arrays have left, the oldest of it first; several threads may use it at once.

    No call waits: where another thread is at it, memory is taken from the system, or goes back.

    ``most_bytes``: what is kept at most; more than that goes back to the system at once.
    """

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._blocks: deque[NDArray[np.uint8]] = deque()
        self._bytes = 0

    @property
    def size_bytes(self) -> int:
        """What is kept now."""
        return self._bytes

    def empty(self, shape: tuple[int, ...] | int, dtype: DTypeLike) -> NDArray[Any]:
        """Return an array like `numpy.empty`, whose memory comes back here after its last view."""
        kind = np.dtype(dtype)
        size_bytes = math.prod(shape if isinstance(shape, tuple) else (shape,)) * kind.itemsize
        if size_bytes < LEAST_BYTES:
            return np.empty(shape, kind)
        block = self._take(size_bytes)
        if block is None:
            block = np.empty(size_bytes, np.uint8)
        return np.asarray(_Owner(block, self)).view(kind).reshape(shape)

    def prepare(self, sizes_bytes: Iterable[int]) -> None:
        """Keep memory of these sizes, each of its pages written once; what is kept counts."""
        with self._lock:
            kept = [block.nbytes for block in self._blocks]
        for size_bytes in sizes_bytes:
            if size_bytes in kept:
                kept.remove(size_bytes)
            elif LEAST_BYTES <= size_bytes <= self._most_bytes:
                block = np.empty(size_bytes, np.uint8)
                block[::PAGE_BYTES] = 0
                self.put(block)

    def put(self, block: NDArray[np.uint8]) -> None:
        """Keep memory that nothing refers to any more, unless it is more than may be kept."""
        if block.nbytes > self._most_bytes:
            return
        # never waiting: a collection of garbage may call this on the very thread that is in `_take`
        if not self._lock.acquire(blocking=False):
            return
        try:
            self._blocks.append(block)
            self._bytes += block.nbytes
            while self._bytes > self._most_bytes:
                self._bytes -= self._blocks.popleft().nbytes
        finally:
            self._lock.release()

    def _take(self, size_bytes: int) -> NDArray[np.uint8] | None:
        """Return the memory of this size that was left last, which caches may still hold."""
        if not self._lock.acquire(blocking=False):
            return None
        try:
            for place in reversed(range(len(self._blocks))):
                if self._blocks[place].nbytes == size_bytes:
                    block = self._blocks[place]
                    del self._blocks[place]
                    self._bytes -= size_bytes
                    return block
            return None
        finally:
            self._lock.release()


class _Owner:
    """What an array and all of its views refer to as the owner of their memory."""

    def __init__(self, block: NDArray[np.uint8], pool: Pool) -> None:
        self.__array_interface__ = block.__array_interface__
        self._block, self._pool = block, pool

    def __del__(self) -> None:
        """Hand the memory back: no view of it is left."""
        self._pool.put(self._block)


POOL: Final = Pool()
"""What all kernels of a process share."""
empty: Final = POOL.empty
