import itertools
import json
import os
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest

import transientcam
from tests.server.contract import client_of
from tests.server.recording.made import assert_same, record
from tests.server.recording.test_recovery import abandoned
from tests.serving import Served, serving
from transientcam import wire
from transientcam_driver import RawFrame
from transientcam_server.api import _downloads as downloads
from transientcam_server.camera import Captured
from transientcam_server.recording import Recording

RECORDINGS = "/api/v1/recordings"
PATIENCE_S = 60.0


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    return tmp_path / "kept"


@pytest.fixture
def daemon(directory: Path) -> Iterator[Served]:
    kept, history = {"directory": directory, "min_free_bytes": 0}, {"seconds": 3600.0}
    with serving(recordings=kept, history=history) as served:
        yield served


@pytest.fixture
def captured(daemon: Served) -> list[RawFrame]:
    """Every frame from now on."""
    frames: list[RawFrame] = []
    happened = daemon.service._happened

    def listen(event: object) -> None:
        if isinstance(event, Captured):
            frames.append(event.raw)
        happened(event)  # type: ignore[arg-type]  # whatever it is

    daemon.service._happened = listen  # type: ignore[method-assign]  # to see what goes in
    return frames


@pytest.fixture
def http(daemon: Served) -> Iterator[httpx.Client]:
    with client_of(daemon) as client:
        yield client


def deep(levels: int) -> Any:
    """A list in a list in a list."""
    return [deep(levels - 1)] if levels > 1 else []


def finished(http: httpx.Client, recording: str, *, unfinished: str = "") -> dict[str, Any]:
    """Wait until a recording has ended by itself, or is recovered from being ``unfinished``."""
    until_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < until_s:
        document: dict[str, Any] = http.get(f"{RECORDINGS}/{recording}").json()
        if document["state"] not in ("recording", "finishing", "recovering", unfinished):
            return document
        time.sleep(0.02)
    raise AssertionError(f"{recording} did not end")


def recorded(http: httpx.Client, **wanted: Any) -> dict[str, Any]:
    """Record a few frames."""
    started = http.post(RECORDINGS, json={"frames": 3, **wanted}).json()
    return finished(http, started["id"])


def test_a_recording_has_every_frame_as_it_was_captured(
    daemon: Served, http: httpx.Client, directory: Path, captured: list[RawFrame]
) -> None:
    document = recorded(http, frames=5)

    assert document["frames"] == 5
    assert document["reason"] == "frames"
    assert document["dropped_frames"] == 0
    with Recording(directory / f"{document['id']}.h5") as recording:
        by_number = {raw.number: raw for raw in captured}
        for raw in recording:
            assert_same(raw, by_number[raw.number])
        assert recording.header.applied == daemon.camera.applied
        assert recording.header.camera["scene"] == "mirrors"


def test_what_just_happened_can_be_saved(
    http: httpx.Client, directory: Path, captured: list[RawFrame]
) -> None:
    http.get("/api/v1/frames/6", params={"wait_s": 10.0})

    started = http.post(RECORDINGS, json={"history_s": 3600.0}).json()
    number = http.get("/api/v1/frames/latest").json()["frame"]
    http.get("/api/v1/frames/latest", params={"after": number + 1, "wait_s": 10.0})
    document = http.post(f"{RECORDINGS}/{started['id']}/stop").json()

    assert started["history_frames"] >= 6
    assert document["frames"] >= started["history_frames"] + 1
    with Recording(directory / f"{document['id']}.h5") as recording:
        numbers = recording.series("device_frame")
        # every frame that was captured, and none twice; a busy machine loses some before that
        known = [raw.number for raw in captured if raw.number <= numbers[-1]]
        assert [each for each in numbers if each >= known[0]] == known
        assert (np.diff(numbers.astype(int)) > 0).all()
        by_number = {raw.number: raw for raw in captured}
        for raw in recording:
            if raw.number in by_number:
                assert_same(raw, by_number[raw.number])
    assert document["duration_s"] > 0.3


def test_only_as_much_of_the_past_is_saved_as_was_asked_for(http: httpx.Client) -> None:
    http.get("/api/v1/frames/12", params={"wait_s": 10.0})
    http.put("/api/v1/acquisition", json={"running": False})

    started = http.post(RECORDINGS, json={"history_s": 0.5}).json()
    document = http.post(f"{RECORDINGS}/{started['id']}/stop").json()

    assert 0 < document["frames"] < http.get("/api/v1/frames").json()["count"]
    assert document["frames"] == started["history_frames"]


def test_one_frame_of_the_last_seconds_is_recorded_alone(http: httpx.Client) -> None:
    http.get("/api/v1/frames/6", params={"wait_s": 10.0})
    wanted = http.get("/api/v1/frames/4/range.npy").content

    identity = http.post(RECORDINGS, json={"frame": 4, "name": "shared"}).json()["id"]
    document = finished(http, identity)

    assert (document["frames"], document["reason"]) == (1, "frames")
    assert http.get(f"{RECORDINGS}/{identity}/frames/1/range.npy").content == wanted

    harmonics = http.get("/api/v1/sequence").json()["harmonics"]
    http.put("/api/v1/sequence", json={"harmonics": harmonics - 1}).raise_for_status()
    # a recording is of one sequence, which is the camera's
    for number, why in ((1_000_000, "unknown-frame"), (4, "frame-gone")):
        refused = http.post(RECORDINGS, json={"frame": number})
        assert refused.json()["type"] == f"/problems/{why}"
    assert http.get(RECORDINGS).json()["active"] is None


def test_no_past_is_a_past_of_no_seconds(http: httpx.Client) -> None:
    http.get("/api/v1/frames/3", params={"wait_s": 10.0})

    started = http.post(RECORDINGS, json={"history_s": 0})

    assert started.status_code == 201
    assert started.json()["history_frames"] is None


@pytest.mark.parametrize("history_s", [-1, 3601, "long"])
def test_a_past_that_cannot_be_is_refused(http: httpx.Client, history_s: object) -> None:
    response = http.post(RECORDINGS, json={"history_s": history_s})

    assert response.status_code == 422
    assert response.json()["field"] == "history_s"


def test_nothing_is_made_on_the_disk_before_the_first_recording(
    http: httpx.Client, directory: Path
) -> None:
    document = http.get(RECORDINGS).json()

    assert document == {
        "directory": str(directory),
        "limits": {
            "max_duration_s": None,
            "max_bytes": None,
            "min_free_bytes": 0,
            "max_upload_bytes": 2 * 1024**3,
        },
        "free_bytes": None,
        "active": None,
        "recordings": [],
        "totals": {"recordings": 0, "frames": 0, "size_bytes": 0, "duration_s": 0},
        "tags": {},
        "next_offset": None,
    }
    assert not directory.exists()


def test_a_recording_can_be_watched_stopped_and_listed(http: httpx.Client) -> None:
    started = http.post(
        RECORDINGS, json={"name": "corner, 3 m", "duration_s": 3600.0, "annotations": {"a": 1}}
    )
    assert started.status_code == 201
    running = started.json()
    assert running["state"] == "recording"
    assert running["limits"]["duration_s"] == 3600.0
    assert http.get(RECORDINGS).json()["active"] == running["id"]

    stopped = http.post(f"{RECORDINGS}/{running['id']}/stop").json()

    assert stopped["state"] == "complete"
    assert stopped["reason"] == "stopped"
    assert stopped["name"] == "corner, 3 m"
    assert stopped["annotations"] == {"a": 1}
    again = http.post(f"{RECORDINGS}/{running['id']}/stop").json()
    assert again == stopped
    listed = http.get(RECORDINGS).json()
    assert listed["active"] is None
    assert listed["recordings"] == [stopped]
    assert listed["free_bytes"] > 0


def test_one_recording_runs_at_a_time(http: httpx.Client) -> None:
    first = http.post(RECORDINGS, json={}).json()

    refused = http.post(RECORDINGS, json={})

    assert refused.status_code == 409
    assert refused.json()["recording"] == first["id"]
    http.post(f"{RECORDINGS}/{first['id']}/stop")
    assert http.post(RECORDINGS, json={}).status_code == 201


def test_a_change_of_the_sequence_ends_a_recording(http: httpx.Client) -> None:
    running = http.post(RECORDINGS, json={}).json()
    http.put("/api/v1/sequence", json={"harmonics": 2})

    assert finished(http, running["id"])["reason"] == "sequence-changed"


def test_a_file_can_be_downloaded_whole_and_in_parts(http: httpx.Client, directory: Path) -> None:
    recording = recorded(http, name="../Vordere Tür, 2. Versuch")["id"]
    data = (directory / f"{recording}.h5").read_bytes()
    url = f"{RECORDINGS}/{recording}/file"

    whole = http.get(url)
    assert whole.content == data
    assert whole.headers["accept-ranges"] == "bytes"
    assert (
        f'filename="Vordere-Tur-2.-Versuch-{recording}.h5"' in whole.headers["content-disposition"]
    )
    for wanted, expected in (
        ("bytes=0-99", data[:100]),
        ("bytes=100-", data[100:]),
        ("bytes=-7", data[-7:]),
    ):
        part = http.get(url, headers={"range": wanted})
        assert part.status_code == 206
        assert part.content == expected
    newer = {"range": "bytes=10-", "if-range": '"something else"'}
    assert http.get(url, headers=newer).content == data


@pytest.mark.parametrize(("wanted", "status"), [("bytes=99999999999-", 416), ("bytes=-0", 416)])
def test_a_range_that_cannot_be_served_is_a_problem(
    http: httpx.Client, directory: Path, wanted: str, status: int
) -> None:
    record_into(directory)

    answer = http.get(f"{RECORDINGS}/a/file", headers={"range": wanted})

    assert answer.status_code == status
    assert answer.json()["field"] == "range"


@pytest.mark.parametrize("wanted", ["bytes=9-5", "frames=1-2", "bytes=a-b", f"bytes={'9' * 5000}-"])
def test_a_range_that_is_none_is_ignored(http: httpx.Client, directory: Path, wanted: str) -> None:
    record_into(directory)

    answer = http.get(f"{RECORDINGS}/a/file", headers={"range": wanted})

    assert answer.status_code == 200
    assert answer.content == (directory / "a.h5").read_bytes()


def test_a_recording_that_runs_is_neither_downloaded_nor_deleted(http: httpx.Client) -> None:
    running = http.post(RECORDINGS, json={}).json()["id"]

    for answer in (
        http.get(f"{RECORDINGS}/{running}/file"),
        http.delete(f"{RECORDINGS}/{running}"),
    ):
        assert answer.status_code == 409
        assert answer.json()["type"] == "/problems/recording-unfinished"


def test_a_recording_can_be_deleted(http: httpx.Client, directory: Path) -> None:
    document = recorded(http)

    assert http.delete(f"{RECORDINGS}/{document['id']}").json() == document
    assert http.get(f"{RECORDINGS}/{document['id']}").status_code == 404
    assert list(directory.iterdir()) == []


def test_annotations_can_be_replaced_while_it_runs_and_afterwards(
    http: httpx.Client, directory: Path
) -> None:
    running = http.post(RECORDINGS, json={"annotations": {"a": 1}}).json()["id"]
    url = f"{RECORDINGS}/{running}"
    assert http.patch(url, json={"annotations": {"b": 2}}).json()["annotations"] == {"b": 2}
    http.post(f"{url}/stop")
    assert http.get(url).json()["annotations"] == {"b": 2}

    assert http.patch(url, json={"annotations": {"ü": [3]}}).json()["annotations"] == {"ü": [3]}

    assert http.get(url).json()["annotations"] == {"ü": [3]}
    with Recording(directory / f"{running}.h5") as recording:  # and nothing else was touched
        assert recording.annotations == {"ü": [3]}
        list(recording)


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"name": ""}, "name"),
        ({"name": "a\nb"}, "name"),
        ({"name": "x" * 201}, "name"),
        ({"name": "\ud800"}, "name"),
        ({"duration_s": 0}, "duration_s"),
        ({"frames": 0}, "frames"),
        ({"max_bytes": -1}, "max_bytes"),
        ({"directory": "/etc"}, "directory"),
        ({"annotations": []}, "annotations"),
        ({"annotations": {"a": "x" * 20_000}}, "annotations"),
        ({"annotations": {"a": "\udfff"}}, "annotations"),
        ({"annotations": {"a": deep(64)}}, "annotations"),
    ],
)
def test_what_cannot_be_recorded_so_is_refused(
    http: httpx.Client, body: dict[str, Any], field: str
) -> None:
    answer = http.post(
        RECORDINGS, content=json.dumps(body), headers={"content-type": "application/json"}
    )

    assert answer.status_code == 422
    assert answer.json()["field"].startswith(field)
    assert http.get(RECORDINGS).json()["recordings"] == []


@pytest.mark.parametrize(
    "name",
    [
        "absent",
        "..%2Fsecret",
        "%2e%2e%2fsecret",
        "secret",
        ".h5",
        "a%00b",
        "a.h5",
        "link",
        "x" * 150,
    ],
)
def test_what_clients_call_a_recording_never_becomes_a_path(
    http: httpx.Client, directory: Path, tmp_path: Path, name: str
) -> None:
    secret = record(tmp_path / "secret.h5", 1)
    record_into(directory)
    (directory / "link.h5").symlink_to(secret)

    for method, path in (
        ("GET", name),
        ("DELETE", name),
        ("GET", f"{name}/file"),
        ("POST", f"{name}/stop"),
    ):
        assert http.request(method, f"{RECORDINGS}/{path}").status_code == 404
    assert secret.exists()
    assert [each["id"] for each in http.get(RECORDINGS).json()["recordings"]] == ["a"]


def test_a_file_that_is_deleted_while_it_is_asked_for_is_unknown(
    daemon: Served, http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = recorded(http)["id"]
    library = daemon.service.recordings
    find = library.path

    def deleted(recording_id: str) -> Path:
        path = find(recording_id)
        monkeypatch.setattr(library, "download_name", lambda of: f"{of}.h5")
        path.unlink()
        return path

    monkeypatch.setattr(library, "path", deleted)

    answer = http.get(f"{RECORDINGS}/{recording}/file")

    assert answer.status_code == 404
    assert answer.json()["type"] == "/problems/unknown-recording"


def test_a_file_that_is_deleted_as_its_answer_begins_is_unknown(
    http: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = recorded(http)["id"]
    answer_with = downloads._File.__call__

    async def deleted(self: downloads._File, *channel: Any) -> None:
        Path(self.path).unlink()
        await answer_with(self, *channel)

    monkeypatch.setattr(downloads._File, "__call__", deleted)

    answer = http.get(f"{RECORDINGS}/{recording}/file")

    assert answer.status_code == 404
    assert answer.json()["type"] == "/problems/unknown-recording"


def test_the_body_of_a_download_waits_for_a_disk_as_all_else_does(
    http: httpx.Client, daemon: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"{RECORDINGS}/{recorded(http)['id']}/file"
    answers, reads = threading.Event(), itertools.count()
    hangs_at = 0

    def hanging(*arguments: int) -> bytes:
        assert threading.current_thread().name.startswith("disk")
        if next(reads) == hangs_at:
            answers.wait()
        return os.pread(*arguments)

    replaced = SimpleNamespace(**{**vars(os), "pread": hanging})
    monkeypatch.setattr(downloads, "os", replaced)
    monkeypatch.setattr(downloads, "_PIECE", 1024)
    monkeypatch.setattr(daemon.service.recordings.disk, "_stalled_s", 0.1)
    answer = http.get(url)
    assert (answer.status_code, answer.json()["type"]) == (503, "/problems/disk-stalled")
    hangs_at, reads = 2, itertools.count()
    with pytest.raises(httpx.RemoteProtocolError):
        http.get(url)
    answers.set()
    assert http.get(url).status_code == 200


def test_a_file_that_is_no_recording_is_listed_as_damaged_and_can_be_deleted(
    http: httpx.Client, directory: Path
) -> None:
    record_into(directory)
    (directory / "broken.h5").write_bytes(b"nothing")

    states = {each["id"]: each["state"] for each in http.get(RECORDINGS).json()["recordings"]}

    assert states == {"a": "complete", "broken": "damaged"}
    assert http.delete(f"{RECORDINGS}/broken").status_code == 200


def test_a_disk_that_is_full_is_a_problem_and_capture_goes_on(
    daemon: Served, http: httpx.Client, directory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorded(http)
    usage = shutil.disk_usage(directory)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage._replace(free=-1))

    refused = http.post(RECORDINGS, json={})

    assert refused.status_code == 507
    assert refused.json()["type"] == "/problems/recording-not-stored"
    assert http.get("/api/v1/frames/latest", params={"after": 5, "wait_s": 10}).status_code == 200


def test_a_directory_that_cannot_be_written_is_a_problem_and_capture_goes_on(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").write_text("in the way")
    with (
        serving(recordings={"directory": tmp_path / "file" / "here"}) as served,
        client_of(served) as http,
    ):
        refused = http.post(RECORDINGS, json={})
        assert refused.status_code == 507
        assert "Not a directory" in refused.json()["detail"]
        assert http.get("/api/v1/frames/latest", params={"wait_s": 10}).status_code == 200


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_directory_is_a_problem(http: httpx.Client, directory: Path) -> None:
    directory.mkdir(mode=0o500)

    assert http.post(RECORDINGS, json={}).status_code == 507


def test_what_was_left_unfinished_is_recovered_at_the_start(directory: Path) -> None:
    directory.mkdir()
    part = abandoned(directory / "left.h5", 4)
    with serving(recordings={"directory": directory}) as served, client_of(served) as http:
        document = finished(http, "left", unfinished="interrupted")

    assert document["state"] == "complete"
    assert document["frames"] == 4
    assert document["reason"] == "interrupted"
    assert not part.exists()


def test_what_another_service_is_writing_is_not_taken_for_abandoned(
    daemon: Served, http: httpx.Client, directory: Path
) -> None:
    running = http.post(RECORDINGS, json={}).json()["id"]

    with serving(recordings={"directory": directory, "min_free_bytes": 0}):
        assert (directory / f"{running}.h5.part").exists()

    assert http.post(f"{RECORDINGS}/{running}/stop").json()["state"] == "complete"


def test_the_end_of_the_service_finishes_the_recording(directory: Path) -> None:
    with serving(recordings={"directory": directory, "min_free_bytes": 0}) as served:
        running = httpx.post(f"{served.url}{RECORDINGS}", json={}).json()["id"]

    with Recording(directory / f"{running}.h5") as recording:
        assert recording.end["reason"] == "shutdown"


def test_streams_are_notified_of_recordings(daemon: Served, http: httpx.Client) -> None:
    import transientcam

    with transientcam.Camera(daemon.url) as camera, camera.stream("range") as stream:
        stream.receive()
        recording = recorded(http, frames=2)["id"]
        reported: list[wire.Notice] = []
        until_s = time.monotonic() + PATIENCE_S
        while len(reported) < 2 and time.monotonic() < until_s:
            stream.receive()
            # a busy machine drops frames, and reports it between
            reported = [each for each in stream.notices if each.kind.startswith("recording-")]
    assert reported[0] == wire.Notice("recording-started", {"recording": recording})
    assert reported[1].kind == "recording-stopped"
    assert reported[1].details["reason"] == "frames"
    assert reported[1].details["frames"] == 2


def test_a_recording_served_as_a_camera_gives_the_same_images_and_refuses_another_sequence(
    http: httpx.Client, directory: Path
) -> None:
    recording = recorded(http)["id"]
    path = directory / f"{recording}.h5"
    with serving(f"recording:{path}?loop=on") as replayed, client_of(replayed) as again:
        frame = wire.parse_frame(
            again.get("/api/v1/frames/latest/raw.msgpack", params={"wait_s": 10}).content
        )
        refused = again.put("/api/v1/sequence", json={"harmonics": 2})
        described = again.get("/api/v1/camera").json()

    with Recording(path) as source:
        position = (frame.meta["frame"] - 1) % source.frames
        np.testing.assert_array_equal(frame.array, source.frame(position).images)
    assert refused.status_code == 422
    assert refused.json()["field"] == "harmonics"
    assert "cannot be changed" in refused.json()["limit"]
    assert described["simulated"] is False


def record_into(directory: Path) -> None:
    directory.mkdir(exist_ok=True)
    record(directory / "a.h5", 2)


def test_recordings_are_listed_by_words_tags_and_pages(daemon: Served, http: httpx.Client) -> None:
    with transientcam.Camera(daemon.url) as camera:
        for name, tags in (("Corner", ["wet"]), ("wall", "wet, far"), ("hall", "")):
            recorded(http, frames=1, name=name, annotations={"tags": tags})

        newest = camera.recordings(limit=2)
        rest = camera.recordings(offset=newest["next_offset"], limit=2)
        wet = camera.recordings(tag="wet", sort="name")
        none = camera.recordings(search="corner far")

    assert [each["name"] for each in newest["recordings"] + rest["recordings"]] == [
        *("hall", "wall", "Corner")
    ]
    assert rest["next_offset"] is None
    assert newest["totals"]["recordings"] == 3
    assert newest["totals"]["size_bytes"] == sum(
        each["size_bytes"] for each in newest["recordings"] + rest["recordings"]
    )
    assert [each["tags"] for each in wet["recordings"]] == [["wet"], ["wet", "far"]]
    assert wet["tags"] == {"wet": 2, "far": 1}
    assert (none["recordings"], none["totals"]["recordings"]) == ([], 0)
    refused = http.get(RECORDINGS, params={"sort": "colour"})
    assert refused.status_code == 422
    assert refused.json()["field"] == "sort"
