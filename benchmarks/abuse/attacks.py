"""Clients that do harm at full speed; each attack runs in a process of its own.

``python -m benchmarks.abuse.attacks NAME URL CONNECTIONS`` attacks until it is ended. It comes from
`SOURCE`, another address than the healthy clients', and leaves the processor to them (`NICE`).
"""

import contextlib
import http.client
import math
import os
import random
import socket
import ssl
import sys
import threading
import time
from collections.abc import Callable, Generator
from functools import partial
from typing import Final
from urllib.parse import urlsplit

from websockets.frames import Frame, Opcode

from transientcam import wire

SOURCE: Final = "127.0.0.2"
HEALTHY: Final = "127.0.0.1"
NICE: Final = 19
_BLOCK_BYTES: Final = 64 * 1024
_TIMEOUT_S: Final = 5.0
_PATIENCE_S: Final = 60.0
"""Of one that waits for its answers."""
_SILENT_AT_ONCE: Final = 70
"""Handshakes that one of 16 attackers leaves open: 1120 together."""

_Address = tuple[str, int]
_Attack = Callable[[_Address], Generator[None]]
"""Attacks over one connection at a time, a step for each item, until that is cut."""


def _connect(
    address: _Address, *, receive_bytes: int | None = None, source: str = SOURCE
) -> socket.socket:
    connection = socket.socket()
    connection.settimeout(_TIMEOUT_S)
    if receive_bytes is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
    connection.bind((source, 0))
    connection.connect(address)
    return connection


def _upgraded(address: _Address) -> socket.socket:
    """Return a WebSocket of the stream, without a subscription and without a token."""
    connection = _connect(address)
    connection.sendall(
        f"GET /api/v1/stream HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        f"Sec-WebSocket-Protocol: {wire.SUBPROTOCOL}\r\n\r\n".encode()
    )
    answer = b""
    while b"\r\n\r\n" not in answer:
        data = connection.recv(1024)
        if not data:
            raise ConnectionError
        answer += data
    return connection


def _frame(opcode: Opcode, data: bytes = b"", *, fin: bool = True) -> bytes:
    return Frame(opcode, data, fin).serialize(mask=True)


def _flooding(frame: bytes, *first: bytes) -> _Attack:
    block = frame * (_BLOCK_BYTES // len(frame))

    def flood(address: _Address) -> Generator[None]:
        with _upgraded(address) as connection:
            connection.sendall(b"".join(first))
            while True:
                connection.sendall(block)
                yield

    return flood


def _sending(head: str, endless: bytes, *, source: str = SOURCE) -> _Attack:
    block = endless * (_BLOCK_BYTES // len(endless))

    def send(address: _Address) -> Generator[None]:
        with _connect(address, source=source) as connection:
            connection.sendall(head.format(host=f"{address[0]}:{address[1]}").encode())
            while True:
                connection.sendall(block)
                yield

    return send


def _connects(address: _Address) -> Generator[None]:
    while True:
        _connect(address).close()
        yield


def _reconnects(address: _Address) -> Generator[None]:
    """Ask for something over a new connection each time, as programs without a pool do."""
    while True:
        with _connect(address) as connection:
            connection.sendall(_asking(address, "/livez"))
            connection.recv(_BLOCK_BYTES)
        yield


def _beginning(begin: bytes, address: _Address) -> Generator[None]:
    """Begin something, and never do it, over as many connections as there may be."""
    with contextlib.ExitStack() as kept:
        for _ in range(_SILENT_AT_ONCE):
            kept.enter_context(_connect(address)).sendall(begin)
            yield
        time.sleep(_TIMEOUT_S)


def _asking(address: _Address, path: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n\r\n".encode()


def _asking_for(*choices: Callable[[], tuple[str, str | None]]) -> _Attack:
    """Ask for something again and again, and read every answer."""

    def ask(address: _Address) -> Generator[None]:
        host, port = address
        with contextlib.closing(
            http.client.HTTPConnection(host, port, timeout=_PATIENCE_S, source_address=(SOURCE, 0))
        ) as connection:
            while True:
                path, body = random.choice(choices)()
                headers = {"Content-Type": "application/json"} if body else {}
                connection.request("POST" if body else "GET", path, body, headers)
                connection.getresponse().read()
                yield

    return ask


def _archive() -> tuple[str, None]:
    """As large an answer as there is in one piece; another one each time."""
    form = random.choice(("npz", "tiff"))
    return f"/api/v1/frames/latest/transient.{form}?bins={random.randint(200, 320)}", None


def _document(path: str) -> tuple[str, None]:
    return path, None


def _nested() -> tuple[str, str]:
    return "/api/v1/lease", '{"x":' * 20_000 + "1" + "}" * 20_000


def _large(address: _Address) -> bytes:
    bins = random.randint(4000, 4096)  # another answer each time: none is remembered
    return _asking(address, f"/api/v1/frames/latest/transient?bins={bins}")


def _slow_reader(address: _Address) -> Generator[None]:
    with _connect(address, receive_bytes=4096) as connection:
        connection.sendall(_large(address))
        while connection.recv(1):
            time.sleep(0.5)
            yield


def _big_read(address: _Address) -> Generator[None]:
    with _connect(address) as connection:
        while True:
            connection.sendall(_large(address))
            while connection.recv(1 << 20):
                yield


_SUBSCRIBE: Final = wire.pack(wire.Subscribe((wire.Subscription("flags"),)).to_document())
_CHUNKED: Final = (
    "POST /api/v1/lease HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"
    "Transfer-Encoding: chunked\r\n\r\n"
)
_PLAN: Final = '{"target": {"range_std_m": 0.01}}'
_DOCUMENTS: Final = ("/openapi.json", "/metrics", "/api/v1/recordings", "/api/v1/parameters", "/")
_PIPELINED: Final = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
ATTACKS: Final[dict[str, _Attack]] = {
    "pongs": _flooding(_frame(Opcode.PONG)),
    "pings": _flooding(_frame(Opcode.PING)),
    "empty fragments": _flooding(_frame(Opcode.CONT, fin=False), _frame(Opcode.BINARY, fin=False)),
    "acks": _flooding(
        _frame(Opcode.BINARY, wire.pack(wire.Ack(1).to_document())),
        _frame(Opcode.BINARY, _SUBSCRIBE),
    ),
    "pipelining": _sending("", _PIPELINED),
    "pipelining, viewer's address": _sending("", _PIPELINED, source=HEALTHY),
    "trailers": _sending(_CHUNKED + "0\r\n", b"a: b\r\n"),
    "endless trailer value": _sending(_CHUNKED + "0\r\na: ", b"x"),
    "tiny chunks": _sending(_CHUNKED, b"1\r\n \r\n"),
    "connects": _connects,
    "reconnecting readers": _reconnects,
    "pretended safe-offs": partial(_beginning, b"POST /api/v1/acquisition/safe-off HTTP/1.1\r\n"),
    "silent TLS handshakes": partial(_beginning, b""),
    "slow readers": _slow_reader,
    "big reads": _big_read,
    "archives": _asking_for(_archive),
    "plans": _asking_for(lambda: ("/api/v1/tradeoff", None), lambda: ("/api/v1/plan", _PLAN)),
    "documents": _asking_for(*(partial(_document, path) for path in _DOCUMENTS)),
    "nested bodies": _asking_for(_nested),
}
"""By name."""
NOT_MIXED: Final = ("silent TLS handshakes", "pipelining, viewer's address")
"""What needs another service, or no other clients."""


def _repeat(attack: _Attack, address: _Address, *, until_s: float = math.inf) -> None:
    """Attack again and again, until a time of the monotonic clock."""
    while time.monotonic() < until_s:
        steps = attack(address)
        try:
            while time.monotonic() < until_s:
                next(steps)
        except (OSError, ssl.SSLError, http.client.HTTPException, StopIteration):
            time.sleep(0.005)  # cut, or refused: once more
        finally:
            steps.close()


def mixed(address: _Address) -> None:
    """Do one of them after the other, each for a while."""
    rest = [each for name, each in ATTACKS.items() if name not in NOT_MIXED]
    while True:
        _repeat(random.choice(rest), address, until_s=time.monotonic() + random.uniform(1.0, 5.0))


def main() -> None:
    """Attack until this process is ended."""
    name, url, connections = sys.argv[1], urlsplit(sys.argv[2]), int(sys.argv[3])
    os.nice(NICE)
    run = mixed if name == "mixed" else partial(_repeat, ATTACKS[name])
    address = url.hostname or "127.0.0.1", url.port or 80
    for _ in range(connections):
        threading.Thread(target=run, args=(address,), daemon=True).start()
    print("attacking", flush=True)
    threading.Event().wait()


if __name__ == "__main__":
    main()
