"""Bounds on a connection: how much its client may send, and how long it may take.

The HTTP server waits for ever for the rest of a request or for a client that reads nothing, reads
heads of any length, and parses requests faster than they are answered; here is what bounds all of
it. How many connections there are is bounded in `transientcam_server.daemon._acceptor`.
"""

import asyncio
from typing import Any, Final, cast

from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from transientcam_server.daemon._metering import in_turns
from transientcam_server.daemon._read_limiter import Valve
from transientcam_server.daemon._refusals import refusal
from transientcam_server.daemon._stalls import CutWhereStalled
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import LimitSettings

_END: Final = b"\r\n\r\n"
"""Of a head, and of a body in chunks (RFC 9112, Sec. 2.1, 7.1)."""
_RENEWED_BYTES: Final = 1024**2
"""Of a body, after which the next ones have their time; only those of files are as long."""


class BoundedConnection(CutWhereStalled, HttpToolsProtocol):
    """One connection, until it ends or becomes a WebSocket; its transport is a `Valve`.

    One request is parsed at a time: the next one is read when the last one is answered.
    """

    transport: Valve  # type: ignore[assignment]  # as far as a protocol can tell, a transport

    def __init__(self, *arguments: Any, limits: LimitSettings, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._limits = limits
        self._deadline: asyncio.TimerHandle | None = None
        self._unparsed = b""
        self._tail = b""
        self._in_head = True
        self._in_works = False
        self._body_left = self._body_bytes = 0
        self._beside_bytes = 0

    # -- of the transport ----------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Register the connection."""
        super().connection_made(cast("asyncio.Transport", transport))
        self.app = in_turns(self.app, lambda: self.transport.account)
        self.flow = FlowControl(cast("asyncio.Transport", transport))
        self._expect_within(self._limits.head_s)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop all timers."""
        self._expect_within(None)
        self._unparsed = b""
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Parse what arrived up to the end of one request."""
        self._unparsed += data
        self._parse()

    def shutdown(self) -> None:
        """End with the service: a request that has not arrived yet is waited for no more."""
        if self._unanswered and self.cycle.more_body:
            self._refuse(Problem(kinds.SHUTTING_DOWN, "The service is shutting down."))
        else:
            super().shutdown()

    # -- of the parser -------------------------------------------------------------------------

    def on_header(self, name: bytes, value: bytes) -> None:
        """Keep a header; what comes after the body is counted and dropped."""
        if self._in_head:
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Expect the body."""
        self._in_head = False
        self._beside_bytes = self._body_bytes = 0
        self._body_left = _length(self.headers)
        self._expect_within(self._limits.body_s)
        self.scope.setdefault("state", {})["offs"] = self.transport.offs
        super().on_headers_complete()
        self.transport.account.begun()
        if self.transport.beyond:
            self.cycle.keep_alive = False

    def on_body(self, body: bytes) -> None:
        """Take a part of the body: it allows for as much beside it, as the sizes of its chunks."""
        self._beside_bytes -= 2 * len(body)
        self._body_left = max(0, self._body_left - len(body))
        self._body_bytes += len(body)
        if self._body_bytes >= _RENEWED_BYTES and self._unanswered:
            self._body_bytes = 0
            self._expect_within(self._limits.body_s)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Parse nothing more until the request is answered."""
        self._in_head = True
        self._beside_bytes = self._body_left = 0
        self._tail = b""
        self._expect_within(None)
        super().on_message_complete()
        self._in_works = self._unanswered
        if not self._in_works:
            self.transport.expect(more=bool(self._unparsed))

    def on_response_complete(self) -> None:
        """Parse on."""
        super().on_response_complete()
        if self._in_works:
            self._in_works = False
            self.transport.expect(more=bool(self._unparsed))
            if self._unparsed:
                self.transport.release(self._parse)

    def handle_websocket_upgrade(self) -> None:
        """Leave the connection to the WebSocket, which has deadlines of its own."""
        self._expect_within(None)
        self._unparsed = b""
        super().handle_websocket_upgrade()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP as everything else is answered."""
        self._refuse(Problem(kinds.BAD_REQUEST, msg))

    # ------------------------------------------------------------------------------------------

    @property
    def _unanswered(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def _parse(self) -> None:
        while self._unparsed and not self._in_works and not self.transport.is_closing():
            end = self._end_of_part()
            part, self._unparsed = self._unparsed[:end], self._unparsed[end:]
            self._feed(part)
        if self._unparsed and self._in_works:
            self.transport.hold()

    def _end_of_part(self) -> int:
        """Return how much may be parsed at once, so that no more than one request ends in it."""
        if self._body_left:
            return self._body_left
        found = (self._tail + self._unparsed).find(_END)
        return len(self._unparsed) if found < 0 else found + len(_END) - len(self._tail)

    def _feed(self, part: bytes) -> None:
        if self._in_head and self._deadline is None:  # the first bytes of one more request
            self._expect_within(self._limits.head_s)
        self._tail = b"" if self._body_left else (self._tail + part)[1 - len(_END) :]
        self._beside_bytes += len(part)
        super().data_received(part)
        if self._beside_bytes > self._limits.head_bytes:
            limit = self._limits.head_bytes
            detail = (
                f"Request line, headers and all else but the body are longer than {limit} bytes."
            )
            self._refuse(Problem(kinds.HEAD_TOO_LARGE, detail, field="headers", limit=limit))

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
        """Answer with a problem, unless another answer is on its way, and end the connection."""
        if self.transport.is_closing():
            return
        if self._unanswered:
            begun = self.cycle.response_started
            self.cycle.disconnected = True  # whatever the application answers now is dropped
            self.cycle.message_event.set()
        else:
            begun = False
        if not begun:
            self.transport.write(refusal(problem))
        self.transport.close()


def _length(headers: list[tuple[bytes, bytes]]) -> int:
    """Return the length of the body where it is announced; the parser has checked it."""
    for name, value in headers:
        if name == b"content-length":
            return int(value)
    return 0
