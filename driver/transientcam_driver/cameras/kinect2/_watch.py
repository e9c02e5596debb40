"""A thread that looks whether something still goes on."""

import threading
from collections.abc import Callable


class Watch:
    """Calls a function where nothing was noted for a time.

    Parameters
    ----------
    interval_s
        After one to two of these without a note.
    idle
        Called on a thread of its own, again and again until something is noted.
    """

    def __init__(self, interval_s: float, idle: Callable[[], None]) -> None:
        self._interval_s = interval_s
        self._idle = idle
        self._notes = 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="kinect2-watch", daemon=True)
        self._thread.start()

    def note(self) -> None:
        """Note that it still goes on."""
        self._notes += 1

    def close(self) -> None:
        """End the thread; the function is not called any more once this returns."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        notes = -1
        while not self._ended.wait(self._interval_s):
            if notes == self._notes:
                self._idle()
            notes = self._notes
