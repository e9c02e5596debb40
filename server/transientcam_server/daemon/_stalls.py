"""Connections whose client reads nothing any more."""

import asyncio


class StallTimer:
    """Aborts a connection that takes nothing for ``limit_s`` while something waits to be written.

    A client that takes little is slow, not gone: what counts is that what waits gets less.
    """

    def __init__(
        self, transport: asyncio.WriteTransport, *, limit_s: float, loop: asyncio.AbstractEventLoop
    ) -> None:
        self._transport = transport
        self._limit_s = limit_s
        self._loop = loop
        self._timer: asyncio.TimerHandle | None = None
        self._left_bytes = 0

    def begin(self) -> None:
        """Start the timer: there is more to write than the connection takes at once."""
        self.end()
        self._left_bytes = self._transport.get_write_buffer_size()
        self._timer = self._loop.call_later(self._limit_s, self._look)

    def end(self) -> None:
        """Stop the timer: the connection takes more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _look(self) -> None:
        if self._transport.get_write_buffer_size() < self._left_bytes:
            self.begin()
        else:
            self._timer = None
            self._transport.abort()
