"""When the light may not stay on: no client could switch it off, or the lease has lapsed.

The event loop that serves clients writes here, the thread that owns the camera reads: the light
does not depend on the loop.
"""

import time
from collections.abc import Callable
from typing import Final

LATE_S: Final = 0.1
"""After a lease has lapsed: the loop, which says so to clients, has so long to act first."""


class LightGuard:
    """What the light needs to stay on.

    Each method is one assignment or reads each value once, so that no thread waits for another.

    Parameters
    ----------
    unserved_s
        For so long the clients' loop may not turn.
    clock
        Time in s; that of the leases.
    """

    def __init__(self, *, unserved_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._unserved_s = unserved_s
        self._clock = clock
        self._turned_s = clock()
        self._lapses_s: float | None = None

    # -- from the loop -------------------------------------------------------------------------

    def turned(self) -> None:
        """Note that clients are served."""
        self._turned_s = self._clock()

    def lapses_at(self, time_s: float | None) -> None:
        """Stop the capture at this time by the clock; None for never."""
        self._lapses_s = time_s

    # -- from the thread of the camera ---------------------------------------------------------

    def lapsed(self) -> bool:
        """Return whether a lease has lapsed that stops the capture; true once for each."""
        lapses_s = self._lapses_s
        if lapses_s is None or self._clock() < lapses_s + LATE_S:
            return False
        self._lapses_s = None
        return True

    def unserved(self) -> str | None:
        """Return why the light has to be off for now, or None."""
        age_s = self._clock() - self._turned_s
        if age_s <= self._unserved_s:
            return None
        return f"no client was served for {self._unserved_s:g} s, so none could switch it off"
