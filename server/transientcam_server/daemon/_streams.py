"""Bounds on a WebSocket: what its client may send, and how long it may read nothing."""

from typing import Any, Final

from uvicorn.protocols.utils import ClientDisconnected
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.server import ServerProtocol
from websockets.typing import StatusLike

from transientcam import wire
from transientcam_server.api import SECURITY_HEADERS
from transientcam_server.daemon._rate_limit import BURST_S, RateLimiter
from transientcam_server.daemon._stalls import CutWhereStalled
from transientcam_server.errors import Problem, kinds, problem_document
from transientcam_server.settings import LimitSettings, StreamSettings

LARGE_BYTES: Final = 1 << 16
"""Messages from this length on are written as they are."""
KIB: Final = 1024
LINGER_S: Final = 1.0
"""Time for the error to reach a client that sends too much."""


class Conversation(ServerProtocol):
    """RFC 6455 as `websockets` has it; a close within a message in parts is a close.

    What is refused before there is a stream carries the security headers of any other answer.
    """

    def reject(self, status: StatusLike, text: str) -> Response:
        """Return the answer to a handshake that fails."""
        response = super().reject(status, text)
        response.headers.update(SECURITY_HEADERS)
        return response

    def recv_frame(self, frame: Frame) -> None:
        """Process a frame; Sec. 7.1.5: what was begun before a close is dropped."""
        if frame.opcode is Opcode.CLOSE:
            self.current_size = None
        super().recv_frame(frame)


class BoundedStream(CutWhereStalled, WebSocketsSansIOProtocol):
    """One WebSocket, which is cut where its client sends too much or reads nothing any more.

    Frames of every kind count: messages, their parts, pings, pongs; and each KiB as one more.
    Before the first answer, the one to its token, a client has no more than may come at once.

    uvicorn's own end of one without pongs waits until everything is written, which is never.
    Large messages are written as they are: what goes to many clients is not copied for each.
    """

    def __init__(
        self, *arguments: Any, limits: LimitSettings, stream: StreamSettings, **options: Any
    ) -> None:
        super().__init__(*arguments, **options)
        self.conn = Conversation(max_size=self.config.ws_max_size, logger=self.conn.logger)
        self._limits = limits
        self._rate_hz = stream.max_messages_hz
        burst = BURST_S * self._rate_hz
        self._rate = RateLimiter(0.0, burst=burst, clock=self.loop.time)
        self._answered = False
        self._received_bytes = 0
        self._cut = False

    def data_received(self, data: bytes) -> None:
        """Read frames, and count them."""
        if not self._cut:
            self._received_bytes += len(data)
            super().data_received(data)

    def handle_events(self) -> None:
        """Handle what was read if it is not too much."""
        count, self._received_bytes = divmod(self._received_bytes, KIB)
        if self._rate.allow(len(self.conn.events) + count):
            super().handle_events()
        else:
            self._cut_off()

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
        """Send a message of the application; the client may acknowledge it."""
        if message["type"] == "websocket.send":
            self._allow_one_more()
        data = message.get("bytes")
        if data is None or len(data) < LARGE_BYTES or not self._open():
            await super().send(message)
            return
        await self.writable.wait()
        if self.transport.is_closing():  # before uvicorn notices it
            raise ClientDisconnected
        if self._open():
            # RFC 6455, Sec. 5.2: the bit FIN, the opcode 2, and 127 for a length of 64 bits
            self.transport.writelines((b"\x82\x7f" + len(data).to_bytes(8, "big"), data))
        else:  # it ended while this waited
            await super().send(message)

    def _allow_one_more(self) -> None:
        if not self._answered:
            self._answered = True
            self._rate = RateLimiter(self._rate_hz, clock=self.loop.time)
        self._rate.credit()

    def _cut_off(self) -> None:
        """End a stream whose client sends more than is read here, and read nothing more of it."""
        self._cut = True
        self.read_paused = False  # or uvicorn would read on with the next message it hands over
        self.transport.pause_reading()
        if not self._open():
            self.transport.abort()
            return
        problem = Problem(
            kinds.TOO_MANY_MESSAGES,
            f"More than {self._rate_hz:g} frames or KiB a second arrived.",
            limit=self._rate_hz,
        )
        self.conn.send_binary(wire.encode(wire.ErrorMessage(problem_document(problem))))
        code = wire.CloseCode.TOO_MANY_MESSAGES
        self.conn.send_close(code, problem.kind.title)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        self.stop_keepalive()
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": ""})
        # closed at once, what is unread here would reset the connection before this has arrived
        self.close_timer = self.loop.call_later(LINGER_S, self.transport.abort)

    def _open(self) -> bool:
        return (
            self.handshake_complete
            and not (self.disconnected or self.close_sent)
            and self.conn.state is State.OPEN
        )
