"""Clients that do harm at full speed; each attack runs in a process of its own.

``python -m benchmarks.abuse.attacks NAME URL CONNECTIONS`` attacks until it is ended. It comes from
`SOURCE`, another address than the healthy clients', and leaves the processor to them (`NICE`).
"""

import os
import random
import socket
import ssl
import sys
import threading
import time
from collections.abc import Callable
from typing import Final
from urllib.parse import urlsplit

from websockets.frames import Frame, Opcode

from transientcam import wire

SOURCE: Final = "127.0.0.2"
NICE: Final = 19
_BLOCK_BYTES: Final = 64 * 1024
_TIMEOUT_S: Final = 5.0
_SILENT_AT_ONCE: Final = 70
"""Handshakes that one of 16 attackers leaves open: 1120 together."""

_Address = tuple[str, int]
_Attack = Callable[[_Address], None]


def _connect(address: _Address, *, receive_bytes: int | None = None) -> socket.socket:
    connection = socket.socket()
    connection.settimeout(_TIMEOUT_S)
    if receive_bytes is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
    connection.bind((SOURCE, 0))
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

    def flood(address: _Address) -> None:
        with _upgraded(address) as connection:
            connection.sendall(b"".join(first))
            while True:
                connection.sendall(block)

    return flood


def _sending(head: str, endless: bytes) -> _Attack:
    block = endless * (_BLOCK_BYTES // len(endless))

    def send(address: _Address) -> None:
        with _connect(address) as connection:
            connection.sendall(head.format(host=f"{address[0]}:{address[1]}").encode())
            while True:
                connection.sendall(block)

    return send


def _connects(address: _Address) -> None:
    while True:
        _connect(address).close()


def _silent(address: _Address) -> None:
    """Connect where TLS is spoken, and say nothing."""
    kept = []
    try:
        for _ in range(_SILENT_AT_ONCE):
            kept.append(_connect(address))
        time.sleep(_TIMEOUT_S)
    finally:
        for each in kept:
            each.close()


def _asking(address: _Address, path: str) -> bytes:
    return f"GET {path} HTTP/1.1\r\nHost: {address[0]}:{address[1]}\r\n\r\n".encode()


def _large(address: _Address) -> bytes:
    bins = random.randint(4000, 4096)  # another answer each time: none is remembered
    return _asking(address, f"/api/v1/frames/latest/transient?bins={bins}")


def _slow_reader(address: _Address) -> None:
    with _connect(address, receive_bytes=4096) as connection:
        connection.sendall(_large(address))
        while connection.recv(1):
            time.sleep(0.5)


def _big_read(address: _Address) -> None:
    with _connect(address) as connection:
        while True:
            connection.sendall(_large(address))
            while connection.recv(1 << 20):
                pass


_SUBSCRIBE: Final = wire.pack(wire.Subscribe((wire.Subscription("flags"),)).to_document())
_CHUNKED: Final = (
    "POST /api/v1/lease HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"
    "Transfer-Encoding: chunked\r\n\r\n"
)
ATTACKS: Final[dict[str, _Attack]] = {
    "pongs": _flooding(_frame(Opcode.PONG)),
    "pings": _flooding(_frame(Opcode.PING)),
    "empty fragments": _flooding(_frame(Opcode.CONT, fin=False), _frame(Opcode.BINARY, fin=False)),
    "acks": _flooding(
        _frame(Opcode.BINARY, wire.pack(wire.Ack(1).to_document())),
        _frame(Opcode.BINARY, _SUBSCRIBE),
    ),
    "pipelining": _sending("", b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"),
    "trailers": _sending(_CHUNKED + "0\r\n", b"a: b\r\n"),
    "endless trailer value": _sending(_CHUNKED + "0\r\na: ", b"x"),
    "tiny chunks": _sending(_CHUNKED, b"1\r\n \r\n"),
    "connects": _connects,
    "silent TLS handshakes": _silent,
    "slow readers": _slow_reader,
    "big reads": _big_read,
}
"""By name: each attacks over one connection at a time, until that ends."""


def _repeat(attack: _Attack, address: _Address) -> None:
    while True:
        try:
            attack(address)
        except (OSError, ssl.SSLError):
            time.sleep(0.005)  # cut, or refused: once more


def mixed(address: _Address) -> None:
    """Do one of them after the other, each for a while."""
    rest = [name for name in ATTACKS if name != "silent TLS handshakes"]
    while True:
        attack = ATTACKS[random.choice(rest)]
        end_s = time.monotonic() + random.uniform(1.0, 5.0)
        while time.monotonic() < end_s:
            try:
                attack(address)
            except OSError:
                time.sleep(0.005)


def main() -> None:
    """Attack until this process is ended."""
    name, url, connections = sys.argv[1], urlsplit(sys.argv[2]), int(sys.argv[3])
    os.nice(NICE)
    attack = mixed if name == "mixed" else ATTACKS[name]
    address = url.hostname or "127.0.0.1", url.port or 80
    for _ in range(connections):
        threading.Thread(target=_repeat, args=(attack, address), daemon=True).start()
    print("attacking", flush=True)
    threading.Event().wait()


if __name__ == "__main__":
    main()
