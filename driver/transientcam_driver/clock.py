"""The clock of a camera: real time, or a virtual one as fast as images can be computed."""

import threading
import time
from typing import Protocol


class Clock(Protocol):
    """Time, and waiting for it."""

    def now_s(self) -> float:
        """Monotonic time."""
        ...

    def unix_s(self) -> float:
        """Unix time."""
        ...

    def wait(self, condition: threading.Condition, timeout_s: float) -> None:
        """Wait, holding the condition, until it is notified or the time has passed."""


class RealClock:
    """Real time."""

    def now_s(self) -> float:
        """Monotonic time."""
        return time.monotonic()

    def unix_s(self) -> float:
        """Unix time."""
        return time.time()

    def wait(self, condition: threading.Condition, timeout_s: float) -> None:
        """Sleep until notified or the time has passed."""
        condition.wait(timeout_s)


class VirtualClock:
    """Time that passes only in waits: a simulation runs as fast as it computes.

    One thread at a time may wait; what other threads do meanwhile takes no time.
    """

    def __init__(self, *, start_s: float = 0.0, unix_s: float = 0.0) -> None:
        self._now_s = start_s
        self._offset_s = unix_s - start_s

    def now_s(self) -> float:
        """Virtual time."""
        return self._now_s

    def unix_s(self) -> float:
        """Virtual time, counted from the Unix time given at the start."""
        return self._now_s + self._offset_s

    def wait(self, condition: threading.Condition, timeout_s: float) -> None:
        """Advance the time at once."""
        self._now_s += max(0.0, timeout_s)

    def sleep(self, duration_s: float) -> None:
        """Advance the time outside of any wait."""
        self._now_s += duration_s
