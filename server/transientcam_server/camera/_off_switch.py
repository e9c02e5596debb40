"""Switches the light off on a thread of its own, whatever the thread of the camera is at."""

import threading
from collections.abc import Callable
from concurrent.futures import Future


class OffSwitch:
    """Runs one function for all who ask while it waits to be run.

    ``switch_off``: switches the light off; may raise `CameraError`.
    """

    def __init__(self, switch_off: Callable[[], None]) -> None:
        self._switch_off = switch_off
        self._lock = threading.Lock()
        self._asked: list[Future[None]] = []
        self._running = False

    def begin(self) -> "Future[None]":
        """Switch off now, or once more as soon as that is done; return what is done with it."""
        future: Future[None] = Future()
        with self._lock:
            self._asked.append(future)
            if not self._running:
                self._running = True
                threading.Thread(target=self._run, name="off-switch", daemon=True).start()
        return future

    def _run(self) -> None:
        while True:
            with self._lock:
                asked, self._asked = self._asked, []
                if not asked:
                    self._running = False
                    return
            error: Exception | None = None
            try:
                self._switch_off()
            except Exception as failure:
                error = failure
            for future in asked:
                if error is None:
                    future.set_result(None)
                else:
                    future.set_exception(error)
