"""Many viewers of a stream in one process, as cheap as sockets allow: they read, and look at meta.

A client library would spend more on each message than the server under test does.
"""

import selectors
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import msgpack  # type: ignore[import-untyped]  # it ships no types
from websockets.client import ClientProtocol
from websockets.frames import Frame as WebSocketFrame, Opcode
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from benchmarks.common.daemon import Process
from transientcam import wire

RANGE = wire.Subscribe((wire.Subscription("range"),)).to_document()
"""The message that subscribes to range."""
_CHUNK_BYTES = 1 << 18
_KEPT_BYTES = 2048
"""Of each message: enough for everything before the array."""
_CONNECT_WITHIN_S = 30.0


def connect(url: str, *, receive_bytes: int | None = None) -> socket.socket:
    """Return a socket on which a WebSocket of the stream has been opened."""
    uri = parse_uri(url)
    protocol = ClientProtocol(uri, subprotocols=[Subprotocol(wire.SUBPROTOCOL)])
    connection = socket.socket()
    if receive_bytes is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
    connection.settimeout(_CONNECT_WITHIN_S)
    connection.connect((uri.host, uri.port))
    protocol.send_request(protocol.connect())
    connection.sendall(b"".join(protocol.data_to_send()))
    answer = b""
    while b"\r\n\r\n" not in answer:  # no byte more: a message may follow
        answer += connection.recv(1)
    if b" 101 " not in answer.partition(b"\r\n")[0]:
        raise ConnectionRefusedError(answer.partition(b"\r\n")[0].decode())
    return connection


def send(connection: socket.socket, document: dict[str, Any]) -> None:
    """Send a message of the protocol."""
    connection.sendall(_masked(Opcode.BINARY, wire.pack(document)))


def _masked(opcode: Opcode, data: bytes) -> bytes:
    return WebSocketFrame(opcode, data).serialize(mask=True)


@dataclass
class ViewerRecord:
    """What one viewer received."""

    numbers: list[int] = field(default_factory=list)
    """Of its frames, in the order they came."""
    latencies_s: list[float] = field(default_factory=list)
    """From the arrival of a frame's last image at the daemon to its last byte here."""
    dropped: int = 0
    """Frames that the daemon said it was too slow for."""
    messages: int = 0
    received_bytes: int = 0

    @property
    def missing(self) -> int:
        """Numbers of frames between the first and the last one that never came."""
        return self.numbers[-1] - self.numbers[0] + 1 - len(self.numbers)


class Viewer:
    """One connection that reads all the time; `read` when there is something."""

    def __init__(self, url: str, subscribe: dict[str, Any] | None, *, look: bool = True) -> None:
        self.connection = connect(url)
        self.seen = ViewerRecord()
        self._look = look
        self._head = bytearray()
        self._kept = bytearray()
        self._left = 0
        self._opcode = 0
        if subscribe is not None:
            send(self.connection, subscribe)
        self.connection.setblocking(False)

    def begin_anew(self) -> None:
        """Forget what was received."""
        self.seen = ViewerRecord()

    def read(self, buffer: memoryview) -> bool:
        """Take what there is; return whether the connection still stands."""
        try:
            count = self.connection.recv_into(buffer)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if not count:
            return False
        self.seen.received_bytes += count
        self._feed(buffer[:count])
        return True

    def _feed(self, data: memoryview) -> None:
        while data:
            if not self._left:
                data = self._begin(data)
                if not self._left:
                    continue
            taken = min(self._left, len(data))
            room = _KEPT_BYTES - len(self._kept)
            if room > 0:
                self._kept += data[: min(taken, room)]
            data = data[taken:]
            self._left -= taken
            if not self._left:
                self._complete()

    def _begin(self, data: memoryview) -> memoryview:
        """Read the head of a WebSocket frame (RFC 6455, Sec. 5.2); servers do not mask."""
        while data:
            self._head.append(data[0])
            data = data[1:]
            if len(self._head) < 2:
                continue
            short = self._head[1]
            extended = {126: 2, 127: 8}.get(short, 0)
            if len(self._head) < 2 + extended:
                continue
            self._opcode = self._head[0] & 15
            length = int.from_bytes(self._head[2:], "big") if extended else short
            self._head.clear()
            self._kept.clear()
            self._left = length
            if not length:
                self._complete()
            break
        return data

    def _complete(self) -> None:
        if self._opcode == Opcode.PING:
            self.connection.send(_masked(Opcode.PONG, bytes(self._kept)))
        elif self._opcode == Opcode.BINARY:
            self.seen.messages += 1
            if self._look:
                self._note()

    def _note(self) -> None:
        message = _beginning(bytes(self._kept))
        if message.get("type") == "frame":
            self.seen.numbers.append(message["meta"]["frame"])
            self.seen.latencies_s.append(time.time() - message["meta"]["host_time_s"])
        elif message.get("kind") == "dropped":
            self.seen.dropped += message["count"]


def _beginning(data: bytes) -> dict[str, Any]:
    """Return the entries of a map as far as ``meta``; a frame's array comes after it."""
    unpacker = msgpack.Unpacker()
    unpacker.feed(data)
    message: dict[str, Any] = {}
    for _ in range(unpacker.read_map_header()):
        key = unpacker.unpack()
        message[key] = unpacker.unpack()
        if key == "meta":
            break
    return message


def watch(
    viewers: Iterable[Viewer],
    *,
    duration_s: float,
    every_s: float = 0.5,
    meanwhile: Callable[[], None] | None = None,
) -> float:
    """Let viewers read for ``duration_s``, return what it really took.

    ``meanwhile`` is called about every ``every_s``.
    """
    buffer = memoryview(bytearray(_CHUNK_BYTES))
    with selectors.DefaultSelector() as selector:
        for viewer in viewers:
            selector.register(viewer.connection, selectors.EVENT_READ, viewer)
        begin_s = time.perf_counter()
        next_s = begin_s + every_s
        while (now_s := time.perf_counter()) < begin_s + duration_s:
            if meanwhile is not None and now_s >= next_s:
                meanwhile()
                next_s = now_s + every_s
            for key, _ in selector.select(timeout=0.05):
                if not key.data.read(buffer):
                    selector.unregister(key.fileobj)
        return time.perf_counter() - begin_s


def spending(
    process: Process, viewers: Sequence[Viewer], *, duration_s: float, **how: Any
) -> tuple[float, float]:
    """Let viewers begin anew, and return how long they read and what a daemon spent then, in s.

    ``how``: As of `watch`.
    """
    for viewer in viewers:
        viewer.begin_anew()
    before_s = process.cpu_s()
    elapsed_s = watch(viewers, duration_s=duration_s, **how)
    return elapsed_s, process.cpu_s() - before_s


def stuck(url: str, subscribe: dict[str, Any]) -> socket.socket:
    """Return the connection of a viewer that subscribes and then never reads."""
    connection = connect(url, receive_bytes=4096)
    send(connection, subscribe)
    return connection


@contextmanager
def beside(run: Callable[[threading.Event], None]) -> Iterator[None]:
    """Run something on a thread until the block ends, which sets its event."""
    ended = threading.Event()
    thread = threading.Thread(target=run, args=(ended,))
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def cut(connections: Iterable[socket.socket]) -> None:
    """End connections at once."""
    for connection in connections:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        connection.close()
