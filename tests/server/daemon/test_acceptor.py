"""Which connections are let in, by a clock that the test moves; and handshakes that never come."""

import socket
import ssl
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from time import monotonic
from typing import Any, cast
from urllib.parse import urlsplit

import httpx
import pytest
import trustme

from tests.server.daemon.loops import Client, Loop
from tests.serving import serving
from transientcam_server.daemon._acceptor import Admission, turns_of_requests
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import LimitSettings

PATIENCE_S = 60.0


class Time:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def time() -> Time:
    return Time()


def admission(time: Time, **limits: float) -> Admission:
    return Admission(LimitSettings.model_validate(limits), clock=time)


def refusals(counted: Admission, host: str, count: int) -> Iterator[Problem]:
    for _ in range(count):
        problem = counted.admit(host)
        if problem is not None:
            yield problem


def test_connections_are_counted_together_and_by_address_until_they_end(time: Time) -> None:
    counted = admission(time, max_connections=5, max_connections_per_address=3)

    assert len(list(refusals(counted, "a", 3))) == 0
    time.now_s += 1.0
    (of_one,) = refusals(counted, "a", 1)
    assert of_one.kind is kinds.TOO_MANY_FROM_ONE_ADDRESS
    (of_all,) = refusals(counted, "b", 3)
    assert of_all.kind is kinds.TOO_MANY_CONNECTIONS
    assert counted.open == 5

    counted.release("a")
    assert counted.admit("c") is None
    assert counted.open == 5


def test_new_connections_come_at_a_rate_of_each_address_and_some_at_once(time: Time) -> None:
    counted = admission(time, max_connects_hz=10.0, max_connections_per_address=4)
    for _ in range(4):
        assert counted.admit("a") is None
        counted.release("a")
    (refused,) = refusals(counted, "a", 1)
    assert refused.kind is kinds.TOO_MANY_FROM_ONE_ADDRESS
    assert refused.extensions["limit"] == 10.0
    assert counted.admit("b") is None

    time.now_s += 0.2
    assert len(list(refusals(counted, "a", 3))) == 1


def test_addresses_that_were_seen_long_ago_are_forgotten(time: Time) -> None:
    counted = admission(time)
    for index in range(5000):
        time.now_s += 1.0
        assert counted.admit(f"host {index}") is None
        counted.release(f"host {index}")

    assert counted.open == 0
    assert len(counted._rates) <= 1024


@pytest.mark.parametrize(
    ("watched", "addresses", "share"), [(True, 1, 0.1), (True, 9, 0.4), (False, 1, 0.9)]
)
def test_requests_leave_time_for_frames_where_there_are_viewers(
    watched: bool, addresses: int, share: float
) -> None:
    loop = Loop()
    turns = turns_of_requests(
        cast("Any", loop),
        limits=LimitSettings(address_share=0.1),
        watched=lambda: watched,
        clock=lambda: loop.now_s,
        spent=lambda: loop.spent_s,
    )
    for address in range(addresses):
        Client(loop, turns.account(str(address))).ask(4)
    for _ in range(20_000):
        loop.pass_s(0.001)

    assert loop.spent_s / loop.now_s == pytest.approx(share, rel=0.1)


def test_handshakes_that_never_come_count_and_are_given_up(tmp_path: Path) -> None:
    authority = trustme.CA()
    certificate = tmp_path / "certificate.pem"
    authority.issue_cert("127.0.0.1").private_key_and_cert_chain_pem.write_to_path(str(certificate))
    trusting = ssl.create_default_context()
    authority.configure_trust(trusting)
    limits = {"max_connections_per_address": 3, "head_s": 3.0}
    with (
        serving("sim:wall?noise=off", tls_certificate=certificate, limits=limits) as served,
        ExitStack() as stack,
    ):
        port = urlsplit(served.url).port
        assert port is not None
        silent = [
            stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
            for _ in range(3)
        ]
        refused = stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
        assert refused.recv(1) == b""  # at once: the other three are still waited for
        for each in silent:
            assert each.recv(1) == b""
        answer = once_there_is_room(f"{served.url}/livez", trusting)

    assert answer.status_code == 200


def once_there_is_room(url: str, trusting: ssl.SSLContext) -> httpx.Response:
    """Ask again while it is refused: a connection that was closed counts for a moment more.

    Its socket is closed first, then the task that waited for its handshake ends the counting.
    """
    end_s = monotonic() + PATIENCE_S
    while True:
        try:
            answer = httpx.get(url, verify=trusting, timeout=PATIENCE_S)
            if answer.status_code != httpx.codes.TOO_MANY_REQUESTS or monotonic() > end_s:
                return answer
        except httpx.TransportError:
            if monotonic() > end_s:
                raise
