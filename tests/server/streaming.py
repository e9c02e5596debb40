"""A plain client of the stream: websockets and the wire contract, none of the package's own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from transientcam import wire

PATIENCE_S = 60.0
VIDEO = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}


class Client:
    """One connection, one message at a time."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def send(self, document: dict[str, Any]) -> None:
        """Send a map."""
        self.connection.send(wire.pack(document))

    def subscribe(self, *products: str | dict[str, Any], **others: Any) -> wire.Hello:
        """Subscribe and return the answer; what comes before it is passed over."""
        subscriptions = [{"product": p} if isinstance(p, str) else p for p in products]
        self.send({"type": "subscribe", "v": 1, "subscriptions": subscriptions, **others})
        message = self.receive_until(lambda each: isinstance(each, wire.Hello | wire.ErrorMessage))
        assert isinstance(message, wire.Hello), message
        return message

    def receive(self, timeout_s: float = PATIENCE_S) -> wire.ServerMessage:
        """Return the next message."""
        return wire.parse_server_message(self.connection.recv(timeout=timeout_s))

    def receive_until(self, wanted: Callable[[wire.ServerMessage], bool]) -> wire.ServerMessage:
        """Return the next message that is wanted; the others are passed over."""
        while True:
            message = self.receive()
            if wanted(message):
                return message

    def frame(self) -> wire.Frame:
        """Return the next frame."""
        message = self.receive_until(lambda each: isinstance(each, wire.Frame))
        assert isinstance(message, wire.Frame)
        return message

    def notice(self, kind: str) -> wire.Notice:
        """Return the next notice of a kind."""
        message = self.receive_until(
            lambda each: isinstance(each, wire.Notice) and each.kind == kind
        )
        assert isinstance(message, wire.Notice)
        return message

    def error(self) -> dict[str, Any]:
        """Return the next problem."""
        message = self.receive_until(lambda each: isinstance(each, wire.ErrorMessage))
        assert isinstance(message, wire.ErrorMessage)
        return dict(message.problem)

    def close_code(self) -> int:
        """Receive until the server ends the stream, and return the code it gives."""
        while True:
            try:
                self.receive()
            except ConnectionClosed as error:
                return wire.CloseCode.ABNORMAL if error.rcvd is None else error.rcvd.code


@contextmanager
def streaming(url: str, **options: Any) -> Iterator[Client]:
    """Connect to a stream."""
    chosen: dict[str, Any] = {
        "subprotocols": [wire.SUBPROTOCOL],
        "compression": None,
        "max_size": None,
        "open_timeout": PATIENCE_S,
        "close_timeout": 1.0,
    }
    with connect(url, **(chosen | options)) as connection:
        yield Client(connection)
