"""Large answers: computed while they are read, and counted until they are."""

import io
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.serving import Served, serving
from transientcam import wire
from transientcam_server.api._middleware.answers import AnswerBudget
from transientcam_server.errors import Problem
from transientcam_server.imaging import Frame
from transientcam_server.settings import LimitSettings

LATEST = "/api/v1/frames/latest"
MIB = 1024 * 1024


@pytest.fixture(scope="module")
def stopped() -> Iterator[Served]:
    """A daemon that has a frame and captures no more, so that all requests are about one frame."""
    limits = {"answers_bytes": 5 * MIB, "answers_bytes_per_address": 5 * MIB}
    with serving("sim:mirrors?noise=off", limits=limits) as daemon:
        daemon.start_all_workers()
        with httpx.Client(base_url=daemon.url, timeout=60.0) as client:
            client.get(LATEST, params={"wait_s": 10.0})
            client.put("/api/v1/acquisition", json={"running": False})
        yield daemon


@pytest.mark.parametrize(
    ("product", "bins"), [("transient", 150), ("cumulative", 150), ("bounds", 40)]
)
def test_what_is_sent_in_bands_is_what_is_sent_whole(
    stopped: Served, product: str, bins: int
) -> None:
    with httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        banded = client.get(f"{LATEST}/{product}", params={"bins": bins})
        part = client.get(f"{LATEST}/{product}", params={"bins": bins, "region": "30,20,50,10"})
        file = client.get(f"{LATEST}/{product}.npy", params={"bins": bins})

    assert len(banded.content) > 4 * MIB
    assert len(part.content) < 4 * MIB
    frame = wire.parse_frame(banded.content)
    expected = wire.parse_frame(part.content)
    # in NumPy a product of matrices, which some BLAS round by a pixel's place
    np.testing.assert_allclose(frame.array[..., 20:30, 30:80], expected.array, rtol=2e-4)
    assert frame.extra["time_s"] == expected.extra["time_s"]
    saved = np.frombuffer(file.content[-frame.array.nbytes :], "<f4").reshape(frame.array.shape)
    np.testing.assert_array_equal(saved, frame.array)
    assert file.content.startswith(b"\x93NUMPY")


def test_the_head_of_a_large_answer_comes_without_its_data(stopped: Served) -> None:
    with httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        answer = client.head(f"{LATEST}/transient", params={"bins": 4096})

    assert answer.status_code == 200
    assert int(answer.headers["Content-Length"]) > 4096 * 163 * 120 * 4


def test_a_large_answer_in_a_format_that_is_made_whole_is_refused(stopped: Served) -> None:
    with httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        problem = client.get(f"{LATEST}/transient.npz", params={"bins": 4096}).json()

    assert (problem["type"], problem["field"]) == ("/problems/answer-too-large", "time_s")


def wait_for_room(daemon: Served) -> None:
    """Wait until answers without a reader are not counted any more."""
    with httpx.Client(base_url=daemon.url, timeout=60.0) as client:
        statuses = iter(
            lambda: client.get(f"{LATEST}/transient", params={"bins": 61}).status_code, 200
        )
        assert set(statuses) <= {503}


def test_readers_that_read_nothing_leave_no_room_until_they_are_gone(stopped: Served) -> None:
    address = urlsplit(stopped.url)
    assert address.port is not None
    request = f"GET {LATEST}/transient?bins=400 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
    with httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        with ExitStack() as stack:
            slow = stack.enter_context(socket.socket())
            slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            slow.connect(("127.0.0.1", address.port))
            slow.sendall(request)
            assert slow.recv(12) == b"HTTP/1.1 200"  # so it is counted
            refused = client.get(f"{LATEST}/transient", params={"bins": 400})
            small = client.get(f"{LATEST}/flags")
        wait_for_room(stopped)

    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/too-many-answers")
    assert refused.headers["Retry-After"] == "1"
    assert small.status_code == 200


def test_a_large_file_for_which_there_is_no_room_is_refused_before_it_is_computed(
    stopped: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = urlsplit(stopped.url)
    assert address.port is not None
    request = f"GET {LATEST}/transient?bins=401 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
    computed = []
    with socket.socket() as slow, httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", address.port))
        slow.sendall(request)
        assert slow.recv(12) == b"HTTP/1.1 200"  # so it is counted

        async def encoded(frame: Frame, *arguments: object) -> bytes:
            computed.append(arguments)
            return b""

        monkeypatch.setattr(Frame, "encoded", encoded)
        refused = client.get(f"{LATEST}/transient.npz", params={"bins": 300})
        small = client.get(f"{LATEST}/flags")
    wait_for_room(stopped)

    assert (refused.status_code, refused.json()["type"]) == (503, "/problems/too-many-answers")
    assert refused.headers["Retry-After"] == "1"
    assert small.status_code == 200
    assert len(computed) == 1  # the small one


def test_what_is_computed_in_bands_is_what_is_computed_at_once(stopped: Served) -> None:
    bins = {"bins": 300}  # more than 4 MiB
    with httpx.Client(base_url=stopped.url, timeout=60.0) as client:
        whole = client.get(f"{LATEST}/cumulative.npz", params=bins).raise_for_status()
        banded = client.get(f"{LATEST}/cumulative.npy", params=bins).raise_for_status()

    with np.load(io.BytesIO(whole.content)) as archive:
        array = archive["array"]
    expected = np.load(io.BytesIO(banded.content))
    assert (array.shape, array.dtype) == ((300, 120, 163), np.dtype("<f4"))
    np.testing.assert_array_equal(array, expected)


def budget(total: int, of_one: int) -> AnswerBudget:
    limits = LimitSettings(answers_bytes=total * MIB, answers_bytes_per_address=of_one * MIB)
    return AnswerBudget(limits)


def test_all_clients_together_have_a_budget_and_each_one_of_its_own() -> None:
    answers = budget(10, 4)
    with ExitStack() as stack:
        stack.enter_context(answers.reserved("a", 4 * MIB))
        with pytest.raises(Problem) as of_one:
            stack.enter_context(answers.reserved("a", 1))
        stack.enter_context(answers.reserved("b", 4 * MIB))
        with pytest.raises(Problem) as of_all:
            stack.enter_context(answers.reserved("c", 5 * MIB))
        assert answers.total_bytes == 8 * MIB

    assert (of_one.value.extensions["limit"], of_all.value.extensions["limit"]) == (
        4 * MIB,
        10 * MIB,
    )
    assert answers.total_bytes == 0


def test_one_answer_may_be_larger_than_the_budget_where_nothing_else_is_on_its_way() -> None:
    answers = budget(10, 4)
    with answers.reserved("a", 100 * MIB), pytest.raises(Problem), answers.reserved("b", 1):
        pass
    with answers.reserved("b", 1):
        pass
