"""Bounds on connections: how many there are, and how long each may take.

The HTTP server waits for ever for the rest of a request or for a client that reads nothing, and
reads heads of any length; here is what bounds all of it.
"""

import asyncio
from typing import Any, cast

from starlette.responses import Response
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol
from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.protocol import State

from transientcam_server.api.problems import problem_response
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import LimitSettings

_LARGE_BYTES = 1 << 16


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


class BoundedConnection(HttpToolsProtocol):
    """One connection, until it ends or becomes a WebSocket."""

    def __init__(self, *arguments: Any, limits: LimitSettings, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._limits = limits
        self._deadline: asyncio.TimerHandle | None = None
        self._stall_timer: StallTimer | None = None
        self._in_head = True
        self._head_bytes = 0

    # -- of the transport ----------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register the connection, or refuse it where there are too many already."""
        super().connection_made(cast("asyncio.Transport", transport))  # uvloop has its own class
        self._stall_timer = StallTimer(
            self.transport, limit_s=self._limits.stalled_s, loop=self.loop
        )
        problem = self._too_many()
        if problem is None:
            self._expect_within(self._limits.head_s)
        else:
            self._refuse(problem)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop all timers."""
        self._expect_within(None)
        if self._stall_timer is not None:
            self._stall_timer.end()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read on, as long as the head of the request is short."""
        if self.transport.is_closing():
            return
        if self._deadline is None and self._idle:  # the first bytes of one more request
            self._expect_within(self._limits.head_s)
        if self._in_head:
            self._head_bytes += len(data)
        super().data_received(data)
        if self._in_head and self._head_bytes > self._limits.head_bytes:
            limit = self._limits.head_bytes
            detail = f"Request line and headers are longer than {limit} bytes."
            self._refuse(Problem(kinds.HEAD_TOO_LARGE, detail, field="headers", limit=limit))

    def pause_writing(self) -> None:
        """Start the timer: the client does not read."""
        super().pause_writing()
        if self._stall_timer is not None:
            self._stall_timer.begin()

    def resume_writing(self) -> None:
        """Stop the timer."""
        if self._stall_timer is not None:
            self._stall_timer.end()
        super().resume_writing()

    # -- of the parser -------------------------------------------------------------------------

    def on_headers_complete(self) -> None:
        """Expect the body."""
        self._in_head = False
        self._head_bytes = 0
        self._expect_within(self._limits.body_s)
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """Expect nothing more for now."""
        self._in_head = True
        self._expect_within(None)
        super().on_message_complete()

    def handle_websocket_upgrade(self) -> None:
        """Leave the connection to the WebSocket, which has deadlines of its own."""
        self._expect_within(None)
        super().handle_websocket_upgrade()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP as everything else is answered."""
        self._refuse(Problem(kinds.BAD_REQUEST, msg))

    # ------------------------------------------------------------------------------------------

    @property
    def _idle(self) -> bool:
        return self.cycle is None or bool(self.cycle.response_complete)

    def _too_many(self) -> Problem | None:
        most, most_of_one = self._limits.max_connections, self._limits.max_connections_per_address
        if len(self.connections) > most:
            return Problem(kinds.TOO_MANY_CONNECTIONS, f"{most} connections are open.", limit=most)
        if self.client is None:
            return None
        here = self.client[0]
        # WebSockets too are in the set; it is as short as the limit
        clients = (getattr(each, "client", None) for each in self.connections)
        if sum(client is not None and client[0] == here for client in clients) > most_of_one:
            return Problem(
                kinds.TOO_MANY_FROM_ONE_ADDRESS,
                f"{most_of_one} connections are open from {here}.",
                limit=most_of_one,
            )
        return None

    def _expect_within(self, duration_s: float | None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = (
            None if duration_s is None else self.loop.call_later(duration_s, self._too_late)
        )

    def _too_late(self) -> None:
        limit_s = self._limits.head_s if self._in_head else self._limits.body_s
        detail = f"The request did not arrive within {limit_s:g} s."
        self._refuse(Problem(kinds.REQUEST_LATE, detail, limit=limit_s))

    def _refuse(self, problem: Problem) -> None:
        if self._idle:  # an answer that is on its way cannot become another one
            self.transport.write(_bytes(problem_response(problem)))
        self.transport.close()


class BoundedStream(WebSocketsSansIOProtocol):
    """One WebSocket, which is cut where its client reads nothing any more.

    uvicorn's own end of one without pongs waits until everything is written, which is never.
    Large messages are written as they are: what goes to many clients is not copied for each.
    """

    def __init__(self, *arguments: Any, limits: LimitSettings, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._limits = limits
        self._stall_timer: StallTimer | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register the connection."""
        super().connection_made(transport)
        self._stall_timer = StallTimer(
            self.transport, limit_s=self._limits.stalled_s, loop=self.loop
        )

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timer."""
        if self._stall_timer is not None:
            self._stall_timer.end()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Start the timer: the client does not read."""
        super().pause_writing()
        if self._stall_timer is not None:
            self._stall_timer.begin()

    def resume_writing(self) -> None:
        """Stop the timer."""
        if self._stall_timer is not None:
            self._stall_timer.end()
        super().resume_writing()

    def shutdown(self) -> None:
        """End with the service; without waiting for a client that reads nothing."""
        if not self.handshake_complete or self.close_sent or self._open():
            super().shutdown()
        else:
            # the client has begun to close: uvicorn would do so again, which its library refuses
            self.stop_keepalive()
            self.transport.close()
        if not self.writable.is_set():
            self.transport.abort()

    async def send(self, message: Any) -> None:
        """Send a message of the application."""
        data = message.get("bytes")
        if data is None or len(data) < _LARGE_BYTES or not self._open():
            await super().send(message)
            return
        await self.writable.wait()
        if self.transport.is_closing():  # before uvicorn notices it
            raise ClientDisconnected
        if self._open():
            self.transport.writelines((_frame_head(len(data)), data))
        else:  # it ended while this waited
            await super().send(message)

    def _open(self) -> bool:
        return (
            self.handshake_complete
            and not (self.disconnected or self.close_sent)
            and self.conn.state is State.OPEN
        )


def _frame_head(length: int) -> bytes:
    """Return what precedes an unmasked binary message of at least 2^16 bytes.

    RFC 6455, Sec. 5.2: the bit FIN, the opcode 2, and 127 for a length of 64 bits.
    """
    return b"\x82\x7f" + length.to_bytes(8, "big")


def _bytes(response: Response) -> bytes:
    """Return an answer as it travels when no application is there to give it."""
    lines = [f"HTTP/1.1 {response.status_code} ".encode(), *_headers(response)]
    return b"\r\n".join([*lines, b"Connection: close", b"", b""]) + bytes(response.body)


def _headers(response: Response) -> list[bytes]:
    return [name + b": " + value for name, value in response.raw_headers]
