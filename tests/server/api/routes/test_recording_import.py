import io
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import numpy as np
import pytest

from tests.server.contract import client_of
from tests.server.recording import children
from tests.server.recording.made import assert_same, frame, record
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam_server.recording import Recording, _uploads as uploads

RECORDINGS = "/api/v1/recordings"
IMPORT = f"{RECORDINGS}/import"
MOST_BYTES = 4 * 1024**2


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module")
def daemon(directory: Path) -> Iterator[Served]:
    kept = {"directory": directory, "min_free_bytes": 0, "max_upload_bytes": MOST_BYTES}
    with serving(recordings=kept) as served:
        served.start_all_workers()
        yield served


@pytest.fixture(scope="module")
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def scratch(directory: Path) -> list[str]:
    return [each.name for each in directory.iterdir() if each.suffix != ".h5"]


def goes_on(http: httpx.Client) -> bool:
    """Wait for a frame that begins after this."""
    number = http.get("/api/v1/frames/latest", params={"wait_s": 10}).json()["frame"]
    query = {"wait_s": 10, "after": number}
    return bool(http.get("/api/v1/frames/latest", params=query).json()["frame"] > number)


def sending(daemon: Served, data: bytes, *, announced: int) -> socket.socket:
    """Begin to send so many bytes, and send some."""
    port = urlsplit(daemon.url).port
    connection = socket.create_connection(("127.0.0.1", port), timeout=60.0)
    head = f"POST {IMPORT} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {announced}\r\n\r\n"
    connection.sendall(head.encode() + data)
    return connection


def test_a_recording_of_another_service_is_one_of_this(
    http: httpx.Client, directory: Path, tmp_path: Path
) -> None:
    original = record(tmp_path / "original.h5", 3, annotations={"sample": "wax"})

    other = record(tmp_path / "other.h5", 2, annotations={"sample": "wax"})

    answers = [http.post(IMPORT, content=each.read_bytes()) for each in (original, other, original)]

    assert [each.status_code for each in answers] == [201, 201, 201]
    first, second, again = (each.json() for each in answers)
    assert first["id"] == again["id"] == "20261120T081500Z-3f9c2a"  # it was here
    assert second["id"] not in ("", first["id"])  # whose id was taken
    for document, frames in ((first, 3), (second, 2)):
        found = document["state"], document["frames"], document["reason"]
        assert found == ("complete", frames, "stopped")
        assert document["annotations"] == {"sample": "wax"}
        with Recording(directory / f"{document['id']}.h5") as taken_in:
            for number, raw in enumerate(taken_in):
                assert_same(raw, frame(number))
            assert taken_in.header.recording_id == document["id"]
    answer = http.get(f"{RECORDINGS}/{second['id']}/frames/2/range.npy").raise_for_status()
    assert np.load(io.BytesIO(answer.content)).shape == (12, 16)
    assert scratch(directory) == []


def test_one_that_is_too_large_is_refused_announced_or_not(
    http: httpx.Client, directory: Path
) -> None:
    announced = http.post(IMPORT, content=bytes(MOST_BYTES + 1))
    counted = http.post(IMPORT, content=iter([bytes(MOST_BYTES), b"x"]))

    for answer in (announced, counted):
        assert (answer.status_code, answer.json()["limit"]) == (413, MOST_BYTES)
    assert scratch(directory) == []


def test_what_is_no_recording_is_refused_and_frames_go_on(
    http: httpx.Client, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "rewrite", children.crash)
    answer = http.post(IMPORT, content=b"anything")

    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-recording")
    assert "has ended" in answer.json()["detail"]
    assert scratch(directory) == []
    assert goes_on(http)


def test_a_client_that_leaves_while_it_sends_leaves_nothing(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    with sending(daemon, bytes(2 * 1024**2), announced=3 * 1024**2):
        wait_until(lambda: len(scratch(directory)) == 2)

    wait_until(lambda: scratch(directory) == [])
    assert goes_on(http)


def test_a_client_that_leaves_while_it_is_read_ends_that(
    daemon: Served, http: httpx.Client, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "rewrite", children.hang)
    with sending(daemon, b"anything", announced=8):
        wait_until((directory / "hanging").exists)
        process = int((directory / "hanging").read_text())
    (directory / "hanging").unlink()

    wait_until(lambda: scratch(directory) == [])
    assert not Path(f"/proc/{process}").exists()
    assert goes_on(http)


def test_a_full_disk_refuses_it_before_it_is_sent(
    daemon: Served, http: httpx.Client, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings: Any = daemon.settings.recordings
    monkeypatch.setitem(vars(settings), "min_free_bytes", 2**62)

    answer = http.post(IMPORT, content=b"anything")

    assert (answer.status_code, answer.json()["type"]) == (507, "/problems/recording-not-stored")
    assert scratch(directory) == []
