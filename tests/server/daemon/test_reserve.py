"""Connections beyond the limits: what switches the light off is served, all else refused."""

import json
import socket
import ssl
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import trustme

from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam_server.daemon import _reserve as reserve

PATIENCE_S = 60.0
HOST = "Host: 127.0.0.1\r\n"
LINE = b"POST /api/v1/acquisition/safe-off HTTP/1.1\r\n"
SAFE_OFF = LINE + HOST.encode() + b"\r\n"
STOP = (
    f"PUT /api/v1/acquisition HTTP/1.1\r\n{HOST}Content-Type: application/json\r\n"
    'Content-Length: 18\r\n\r\n{"running": false}'
).encode()
START = STOP.replace(b"false", b"true ")
BACK = f"DELETE /api/v1/lease HTTP/1.1\r\n{HOST}Transientcam-Lease: none\r\n\r\n".encode()
READ = f"GET /livez HTTP/1.1\r\n{HOST}\r\n".encode()
Connect = Callable[..., socket.socket]


@contextmanager
def full(**limits: float) -> Iterator[tuple[Served, Connect]]:
    """A lit camera whose limit of connections is reached, by silent ones of both addresses."""
    with serving("sim:wall?noise=off", limits=limits) as served, ExitStack() as stack:
        port = urlsplit(served.url).port
        assert port is not None

        def connect(data: bytes = b"", *, source: str = "127.0.0.1") -> socket.socket:
            connection = stack.enter_context(socket.socket())
            connection.settimeout(PATIENCE_S)
            connection.bind((source, 0))
            connection.connect(("127.0.0.1", port))
            connection.sendall(data)
            return connection

        wait_until(lambda: served.camera.status().light_on)
        for _ in range(2):
            connect()
        yield served, connect


def answer(connection: socket.socket) -> tuple[int, dict[str, str], dict[str, Any]]:
    """Read to the end: whatever is answered beyond a limit, the connection is closed."""
    data = b""
    while part := connection.recv(1 << 16):
        data += part
    head, _, body = data.partition(b"\r\n\r\n")
    line, *fields = head.decode().split("\r\n")
    headers = {name.lower(): value for name, _, value in (each.partition(": ") for each in fields)}
    return int(line.split()[1]), headers, json.loads(body)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reserve, "LOOK_S", PATIENCE_S)


@pytest.mark.usefixtures("patient")
@pytest.mark.parametrize(
    ("limits", "status", "kind"),
    [
        ({"max_connections": 2}, 503, "too-many-connections"),
        ({"max_connections_per_address": 2}, 429, "too-many-from-one-address"),
        (
            {"max_connects_hz": 1e-6, "max_connections_per_address": 2},
            429,
            "too-many-from-one-address",
        ),
    ],
    ids=["together", "of one address", "rate"],
)
def test_beyond_each_limit_the_light_is_switched_off_and_nothing_else_done(
    limits: dict[str, float], status: int, kind: str
) -> None:
    with full(**limits) as (served, connect):
        for refused in (READ, START):
            code, headers, document = answer(connect(refused))
            assert (code, document["type"]) == (status, f"/problems/{kind}")
            assert headers["retry-after"] == "1"
            assert headers["x-content-type-options"] == "nosniff"
        assert answer(connect(BACK))[2]["type"] == "/problems/lease-lost"
        assert served.camera.status().light_on

        code, headers, document = answer(connect(STOP))
        assert (code, document["state"], headers["connection"]) == (200, "stopped", "close")
        assert not served.camera.status().light_on
        code, headers, document = answer(connect(SAFE_OFF))
        assert (code, document["state"], headers["connection"]) == (200, "stopped", "close")


@pytest.mark.usefixtures("patient")
def test_a_request_in_pieces_is_waited_for() -> None:
    with full(max_connections=2) as (served, connect):
        connection = connect()
        for begin in range(0, len(SAFE_OFF), 20):
            connection.sendall(SAFE_OFF[begin : begin + 20])
        assert answer(connection)[0] == 200
        assert not served.camera.status().light_on


@pytest.mark.usefixtures("patient")
def test_pretending_takes_no_room_from_it_at_the_same_address() -> None:
    with full(max_connections=2) as (_, connect):
        pretending = [connect(LINE) for _ in range(reserve.MOST + 4)]
        assert answer(connect(SAFE_OFF))[0] == 200
        for given_up in pretending[:4]:  # the oldest, for those that came later
            assert answer(given_up)[0] == 503


@pytest.mark.usefixtures("patient")
def test_nor_at_another_address_whoever_was_first() -> None:
    with full(max_connections=2) as (_, connect):
        begun = connect(LINE)
        for index in range(2 * reserve.MOST):
            connect(LINE if index % 2 else b"", source="127.0.0.2")
        assert answer(connect(SAFE_OFF))[0] == 200
        begun.sendall(SAFE_OFF.removeprefix(LINE))
        assert answer(begun)[0] == 200


@pytest.mark.parametrize("begin", [b"", LINE], ids=["silent", "pretending"])
def test_what_does_not_become_one_is_refused_soon(
    begin: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reserve, "LOOK_S", 0.1)
    with full(max_connections=2) as (_, connect):
        assert answer(connect(begin))[0] == 503


@pytest.mark.usefixtures("patient")
def test_it_is_served_beyond_the_limits_with_tls_too(tmp_path: Path) -> None:
    authority = trustme.CA()
    certificate = tmp_path / "certificate.pem"
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(str(certificate))
    trusting = ssl.create_default_context()
    authority.configure_trust(trusting)
    limits = {"max_connections": 2, "head_s": PATIENCE_S}
    with (
        serving("sim:wall?noise=off", tls_certificate=certificate, limits=limits) as served,
        ExitStack() as stack,
    ):
        port = urlsplit(served.url).port
        assert port is not None

        def connect() -> socket.socket:
            return stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))

        wait_until(lambda: served.camera.status().light_on)
        for _ in range(2):
            connect()
        for data, status in ((READ, 503), (SAFE_OFF, 200)):
            spoken = trusting.wrap_socket(connect(), server_hostname="127.0.0.1")
            stack.enter_context(spoken)
            spoken.sendall(data)
            assert answer(spoken)[0] == status
        assert not served.camera.status().light_on
