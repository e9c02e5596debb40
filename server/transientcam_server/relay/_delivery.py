"""Requests to the origin that are not given up.

Each is sent at once, over a connection of its own, and again over others until the origin has
confirmed one: a network may be silent, slow, or gone for now.
"""

import asyncio
import contextlib
import logging
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import Future, wait
from functools import partial
from itertools import chain, repeat
from typing import Final

from transientcam_driver import CameraError, CameraLost
from transientcam_server.errors import OriginRefused

_log = logging.getLogger("transientcam_server.relay.delivery")
PAUSES_S: Final = (1.0, 2.0, 4.0)
"""Between two attempts; the last one repeats."""
ATTEMPT_S: Final = 60.0
"""Time for an attempt: an answer may come through several slow networks."""
_GAP_S: Final = 0.1
"""Between two attempts, however often they are asked for."""
_MOST_ATTEMPTS: Final = 32
"""Under way at the same time; the oldest one is given up for one more."""


class Delivery:
    """One request, sent until the origin has confirmed it or refuses it for good.

    It may be asked for again and again, from any thread; a confirmation is good for those who
    asked before the attempt that it answers.

    ``send``: sends the request once. `OriginRefused` is final, any other error is not.
    ``changed``: called on a thread of this delivery when it takes long, with False, and when that
    has ended, with True.
    ``pauses_s``: as `PAUSES_S`.
    """

    def __init__(
        self,
        send: Callable[[], Awaitable[None]],
        *,
        changed: Callable[[bool], None] = lambda ended: None,
        pauses_s: tuple[float, ...] | None = None,
    ) -> None:
        self._send = send
        self._changed = changed
        self._pauses_s = PAUSES_S if pauses_s is None else pauses_s
        self._lock = threading.Lock()
        self._asked = 0
        self._waiting: list[tuple[int, Future[None]]] = []
        self._thread: threading.Thread | None = None
        self._sending = False
        self._wake: Callable[[], object] | None = None

    @property
    def asked(self) -> int:
        """How often it was asked for."""
        return self._asked

    @property
    def unconfirmed(self) -> bool:
        """Whether it was asked for and is not confirmed yet."""
        return bool(self._waiting)

    def begin(self) -> "Future[None]":
        """Send the request now, and return what is done once it is confirmed, or refused."""
        future: Future[None] = Future()
        with self._lock:
            self._asked += 1
            self._waiting.append((self._asked, future))
            if not self._sending:
                self._sending = True
                self._thread = threading.Thread(
                    target=lambda: asyncio.run(self._deliver()), name="relay-delivery", daemon=True
                )
                self._thread.start()
            elif self._wake is not None:
                self._wake()
        return future

    def wait(self, timeout_s: float) -> None:
        """Wait until nothing is unconfirmed, or no longer than this."""
        wait([future for _, future in self._waiting], timeout_s)

    def end(self, reason: str, *, asked: int | None = None) -> None:
        """Send it no more for those who wait, the first ``asked`` of all; they get `CameraLost`."""
        self._settle(self._asked if asked is None else asked, CameraLost(reason))
        with self._lock:
            if self._wake is not None:
                self._wake()

    def join(self) -> None:
        """Wait until nothing is sent any more, behind `end`."""
        if self._thread is not None:
            self._thread.join()

    def _settle(self, asked: int, error: CameraError | None) -> None:
        """Tell those who had asked by then."""
        with self._lock:
            done = [future for number, future in self._waiting if number <= asked]
            self._waiting = [each for each in self._waiting if each[0] > asked]
        for future in done:
            if error is None:
                future.set_result(None)
            else:
                future.set_exception(error)

    async def _deliver(self) -> None:
        loop, woken = asyncio.get_running_loop(), asyncio.Event()
        attempts: dict[asyncio.Task[None], int] = {}
        pauses_s = chain(self._pauses_s, repeat(self._pauses_s[-1]))
        slow = False
        try:
            while True:
                with self._lock:
                    self._wake = partial(loop.call_soon_threadsafe, woken.set)
                    if not self._waiting:
                        self._sending, self._wake = False, None
                        break
                    woken.clear()
                    asked = self._asked
                if len(attempts) >= _MOST_ATTEMPTS:
                    next(iter(attempts)).cancel()
                attempts[asyncio.create_task(self._attempt())] = asked
                begun_s = loop.time()
                await self._wait(attempts, woken, until_s=begun_s + next(pauses_s))
                if not slow and self._waiting and not woken.is_set():
                    slow = True
                    self._changed(False)
                if self._waiting and woken.is_set():
                    await asyncio.sleep(max(0.0, begun_s + _GAP_S - loop.time()))
        finally:
            for attempt in attempts:
                attempt.cancel()
            await asyncio.gather(*attempts, return_exceptions=True)
        if slow:
            self._changed(True)

    async def _wait(
        self, attempts: dict[asyncio.Task[None], int], wake: asyncio.Event, *, until_s: float
    ) -> None:
        """Take what comes of attempts, until another one is due or none is needed any more."""
        loop = asyncio.get_running_loop()
        woken = asyncio.create_task(wake.wait())
        try:
            while self._waiting and not woken.done() and (left_s := until_s - loop.time()) > 0.0:
                await asyncio.wait(
                    (*attempts, woken), timeout=left_s, return_when=asyncio.FIRST_COMPLETED
                )
                for attempt in [each for each in attempts if each.done()]:
                    asked = attempts.pop(attempt)
                    error = None if attempt.cancelled() else attempt.exception()
                    if isinstance(error, OriginRefused):
                        self._settle(asked, error)
                    elif error is None and not attempt.cancelled():
                        self._settle(asked, None)
                    else:
                        _log.info("not confirmed, and sent again: %s", error)
        finally:
            woken.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await woken

    async def _attempt(self) -> None:
        async with asyncio.timeout(ATTEMPT_S):
            await self._send()
