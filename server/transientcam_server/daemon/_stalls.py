"""Connections whose client reads nothing any more."""

import asyncio
from typing import Any

from transientcam_server.settings import LimitSettings


class CutWhereStalled(asyncio.Protocol):
    """A protocol whose connection is aborted where it takes nothing while something is to be sent.

    A client that takes little is slow, not gone: what counts is that what waits gets less.
    """

    loop: asyncio.AbstractEventLoop
    transport: Any
    _limits: LimitSettings
    _stall_timer: asyncio.TimerHandle | None = None
    _waiting_bytes = 0

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timer."""
        self._end_stall()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Start the timer: there is more to write than the connection takes at once."""
        super().pause_writing()
        self._begin_stall()

    def resume_writing(self) -> None:
        """Stop the timer: the connection takes more."""
        self._end_stall()
        super().resume_writing()

    def _begin_stall(self) -> None:
        self._end_stall()
        self._waiting_bytes = self.transport.get_write_buffer_size()
        self._stall_timer = self.loop.call_later(self._limits.stalled_s, self._look)

    def _end_stall(self) -> None:
        if self._stall_timer is not None:
            self._stall_timer.cancel()
            self._stall_timer = None

    def _look(self) -> None:
        if self.transport.get_write_buffer_size() < self._waiting_bytes:
            self._begin_stall()
        else:
            self._stall_timer = None
            self.transport.abort()
