"""A point in time until which to wait."""

import time
from collections.abc import Callable

from transientcam.errors import FrameTimeout


class Deadline:
    """``timeout_s`` from now, by ``clock``; never, if None."""

    def __init__(
        self, timeout_s: float | None, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._timeout_s = timeout_s
        self._clock = clock
        self._start_s = clock()

    def left_s(self) -> float | None:
        """Return the seconds that are left, never negative; None where there is no end."""
        if self._timeout_s is None:
            return None
        return max(0.0, self._timeout_s - (self._clock() - self._start_s))

    def allows(self, wait_s: float) -> bool:
        """Return whether ``wait_s`` from now is still before the deadline."""
        left_s = self.left_s()
        return left_s is None or wait_s < left_s

    def missed(self) -> FrameTimeout:
        """Return the error for a missed deadline."""
        return FrameTimeout(self._timeout_s or 0.0)
