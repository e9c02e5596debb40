"""When the light may begin, and when it may not stay on.

It may not where no client could switch it off, a lease has lapsed, or nobody uses the capture. The
event loop that serves clients writes here, the thread that owns the camera reads: the light does
not depend on the loop.
"""

import asyncio
import math
import time
from collections.abc import Callable
from typing import Final

LATE_S: Final = 0.1
"""After a lease has lapsed: the loop, which says so to clients, has so long to act first."""
_TURN_S: Final = 0.2


class LightGuard:
    """What the light needs to stay on.

    Each value is assigned or read in one step, so that no thread waits for another.

    ``unserved_s``: for so long the clients' loop may not turn.
    ``unused_s``: for so long a capture may go on that nobody uses.
    ``clock``: time in s; that of the leases.
    """

    def __init__(
        self,
        *,
        unserved_s: float,
        unused_s: float = math.inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._unserved_s = unserved_s
        self._unused_s = unused_s
        self._clock = clock
        self._turned_s = self._used_s = clock()
        self._lapses_s: float | None = None

    # -- from the loop -------------------------------------------------------------------------

    def turned(self) -> None:
        """Note that clients are served; from any thread."""
        self._turned_s = self._clock()

    def lapses_at(self, time_s: float | None) -> None:
        """Stop the capture at this time by the clock; None for never."""
        self._lapses_s = time_s

    def used(self) -> None:
        """Note that somebody uses the capture, or has just started it; from any thread."""
        self._used_s = self._clock()

    async def keep(self, *, used: Callable[[], bool], reads: Callable[[], int]) -> None:
        """Prove to the camera's thread, again and again, that clients are served and use it.

        ``used``: Whether somebody needs the capture, but for single frames: ``reads`` counts those.
        """
        before = reads()
        while True:
            self.turned()
            if used() or reads() != before:
                self.used()
            before = reads()
            await asyncio.sleep(_TURN_S)

    # -- from the thread of the camera ---------------------------------------------------------

    def lapsed(self) -> bool:
        """Return whether a lease has lapsed that stops the capture; true once for each."""
        lapses_s = self._lapses_s
        if lapses_s is None or self._clock() < lapses_s + LATE_S:
            return False
        self._lapses_s = None
        return True

    def unserved(self) -> str | None:
        """Return why a capture has to end that no client can stop, or None."""
        late = self._clock() - self._turned_s > self._unserved_s
        return f"none was served for {self._unserved_s:g} s" if late else None

    def unused(self) -> str | None:
        """Return why a capture has to end that nobody uses, or None."""
        late = self._clock() - self._used_s > self._unused_s
        words = f"no viewer, reader, recording, job or lease for {self._unused_s:g} s"
        return words if late else None


class Announcement:
    """Light begins ``delay_s`` after it was announced; the camera's thread does, any may look."""

    def __init__(self, delay_s: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        self.delay_s = delay_s
        self._clock = clock
        self._on_s: float | None = None

    @property
    def light_on_in_s(self) -> float | None:
        """Time until the light begins; None where none is announced, or it may be on already."""
        on_s = self._on_s
        left_s = 0.0 if on_s is None else on_s - self._clock()
        return left_s if left_s > 0.0 else None

    def begin(self) -> bool:
        """Announce the light; return whether it was not announced before."""
        if self._on_s is not None:
            return False
        self._on_s = self._clock() + self.delay_s
        return True

    def withdraw(self) -> None:
        """Take the announcement back: the next light is announced anew."""
        self._on_s = None
