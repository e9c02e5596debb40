"""One connection to the stream, message by message, as docs/stream.md has them."""

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar
from urllib.parse import urlsplit

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from transientcam.errors import PromiseBroken, ProtocolError
from transientcam.transport import stream_options, translated
from transientcam.wire import (
    Ack,
    Channel,
    CloseCode,
    ErrorMessage,
    Frame,
    Hello,
    Notice,
    ServerMessage,
    Subscribe,
    Subscription,
    encode,
    pack,
    parse_channels,
    parse_server_message,
)
from transientcam_conformance._expecting import expect

_M = TypeVar("_M", Hello, Frame, Notice, ErrorMessage)
_SMALL_BUFFER_BYTES = 4096


class Conversation:
    """One connection, and the messages of it in the order they arrived."""

    def __init__(self, connection: ClientConnection, url: str, *, timeout_s: float) -> None:
        self._connection = connection
        self._url = url
        self._timeout_s = timeout_s
        self.hello: Hello | None = None
        self.channels: tuple[Channel, ...] = ()
        self.notices: list[Notice] = []

    def send(self, document: dict[str, Any]) -> None:
        """Send any map."""
        with translated(self._url):
            self._connection.send(pack(document))

    def send_text(self, text: str) -> None:
        """Send a text message, which the protocol does not have."""
        with translated(self._url):
            self._connection.send(text)

    def acknowledge(self, frame: int) -> None:
        """Acknowledge a frame and all before it."""
        with translated(self._url):
            self._connection.send(encode(Ack(frame)))

    def subscribe(self, message: Subscribe) -> Hello:
        """Subscribe and return the greeting."""
        with translated(self._url):
            self._connection.send(encode(message))
        return self.greeting()

    def greeting(self) -> Hello:
        """Return the next hello; messages before it are skipped."""
        return self._next(Hello, lambda hello: True, "no hello")

    def frame(self, matches: Callable[[Frame], bool] = lambda frame: True) -> Frame:
        """Return the next frame that ``matches``; messages before it are skipped."""
        return self._next(Frame, matches, "no such frame")

    def notice(self, *kinds: str) -> Notice:
        """Return the next notice of these kinds; messages before it are skipped."""
        what = f"no notice {' or '.join(kinds)}"
        return self._next(Notice, lambda notice: notice.kind in kinds, what)

    def problem(self) -> dict[str, Any]:
        """Return the next problem; messages before it are skipped."""
        what = "no problem that answers a message which cannot be used"
        return dict(self._next(ErrorMessage, lambda error: True, what).problem)

    def receive(self) -> ServerMessage:
        """Return the next message."""
        message = self._receive(self._timeout_s)
        match message:
            case Hello():
                self.hello, self.channels = message, message.channels
            case Notice():
                self.notices.append(message)
                if message.kind == "sequence-changed":
                    self.channels = parse_channels(message.details)
        return message

    def close_code(self) -> int:
        """Receive until the other end closes, and return the code it gives."""
        end_s = time.monotonic() + self._timeout_s
        while time.monotonic() < end_s:
            try:
                self._connection.recv(timeout=self._timeout_s)
            except ConnectionClosed as error:
                return CloseCode.ABNORMAL if error.rcvd is None else error.rcvd.code
            except TimeoutError:
                break
        raise PromiseBroken("the stream is not closed")

    def dropped(self, channel: int) -> int:
        """Return how many frames of a channel were dropped, by the notices so far."""
        drops = [each.details for each in self.notices if each.kind == "dropped"]
        return sum(int(each["count"]) for each in drops if each.get("channel") == channel)

    def _next(self, kind: type[_M], matches: Callable[[_M], bool], missing: str) -> _M:
        end_s = time.monotonic() + self._timeout_s
        while time.monotonic() < end_s:
            message = self.receive()
            if isinstance(message, kind) and matches(message):
                return message
            if isinstance(message, ErrorMessage):
                detail = message.problem.get("detail")
                raise PromiseBroken(f"the stream reports a problem: {detail}")
        raise PromiseBroken(f"{missing} within {self._timeout_s:g} s")

    def _receive(self, timeout_s: float) -> ServerMessage:
        try:
            with translated(self._url):
                try:
                    data = self._connection.recv(timeout=timeout_s)
                except TimeoutError:
                    what = f"no message on the stream within {timeout_s:g} s"
                    raise PromiseBroken(what) from None
            return parse_server_message(data)
        except ProtocolError as error:
            raise PromiseBroken(f"the stream sends what is not documented: {error}") from error


@contextmanager
def connected(
    url: str,
    *products: str,
    token: str | None = None,
    timeout_s: float,
    credit: int | None = None,
    start: int | None = None,
    silent: bool = False,
    unread: bool = False,
) -> Iterator[Conversation]:
    """Connect to a stream, and subscribe to ``products`` unless there are none.

    ``silent`` sends no subscription; ``unread`` keeps the buffers of this end so small that unread
    messages stay with the camera.
    """
    options = stream_options(url, timeout_s=timeout_s, threaded=True)
    if unread:
        options |= {"max_queue": 1, "sock": _small_socket(url, timeout_s)}
    with translated(url), connect(url, **options) as connection:
        conversation = Conversation(connection, url, timeout_s=timeout_s)
        if not silent:
            subscriptions = tuple(Subscription(each) for each in products)
            message = Subscribe(subscriptions, token=token, credits=credit, start=start)
            hello = conversation.subscribe(message)
            expect(len(hello.channels) == len(products), "not every subscription has a channel")
        yield conversation


def _small_socket(url: str, timeout_s: float) -> socket.socket:
    parts = urlsplit(url)
    port = parts.port or (443 if parts.scheme == "wss" else 80)
    place = socket.getaddrinfo(parts.hostname, port, type=socket.SOCK_STREAM)[0]
    small = socket.socket(*place[:3])
    try:
        # before it connects, or the system chooses the window
        small.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SMALL_BUFFER_BYTES)
        small.settimeout(timeout_s)
        small.connect(place[4])
    except OSError:
        small.close()
        raise
    return small
