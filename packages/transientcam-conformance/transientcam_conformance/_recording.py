"""Recordings: the captured images, bit for bit, in their files and when they are replayed."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np

from transientcam.wire import Frame, Notice
from transientcam_conformance._device import API, Device
from transientcam_conformance._expecting import equal, expect, skip_unless
from transientcam_conformance._replaying import can_replay, replayed

_RECORDINGS: Final = f"{API}/recordings"
_FRAMES: Final = 4
_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_ANNOTATIONS: Final = {"of": "transientcam conformance"}


def a_recording_is_announced_and_described(device: Device) -> None:
    """Streams get notices when a recording begins and ends, and its description is complete."""
    with _recorded(device) as (recording, _):
        found = recording["state"], recording["frames"], recording["dropped_frames"]
        equal(found, ("complete", _FRAMES, 0), "state, frames and dropped frames of the recording")
        equal(recording["reason"], "frames", "the reason why it ended")
        equal(recording["annotations"], _ANNOTATIONS, "its annotations")
        listed = [each["id"] for each in device.read(_RECORDINGS)["recordings"]]
        expect(recording["id"] in listed, "the recording is not in the list")


def one_recording_runs_at_a_time(device: Device) -> None:
    """While a recording runs, another one is refused with 409, naming the one that runs."""
    with _deletable(device) as ids, device.capturing():
        running = _start(device, ids, frames=None)
        try:
            second = device.send("POST", _RECORDINGS, json={})
            problem = device.refusal(second, 409, "recording-runs")
            equal(problem.get("recording"), running["id"], "`recording` in the problem")
            response = device.send("GET", f"{_RECORDINGS}/{running['id']}/file")
            device.refusal(response, 409, "recording-unfinished")
        finally:
            stopped = device.document(device.send("POST", f"{_RECORDINGS}/{running['id']}/stop"))
        equal(stopped["reason"], "stopped", "the reason why it ended")


def a_file_can_be_fetched_in_parts(device: Device) -> None:
    """The file of a recording is HDF5, and ranges of it are answered with 206."""
    with _recorded(device) as (recording, _):
        path = f"{_RECORDINGS}/{recording['id']}/file"
        whole = device.send("GET", path)
        equal(whole.content[:8], _HDF5, "the beginning of the file")
        part = device.send("GET", path, headers={"range": "bytes=8-1007"})
        equal(part.status_code, 206, "the status of a range")
        expect(part.content == whole.content[8:1008], "a range differs from the whole file")
        beyond = {"range": f"bytes={len(whole.content) + 1}-"}
        device.refusal(device.send("GET", path, headers=beyond), 416, "range-not-satisfiable")


def recorded_frames_are_those_that_were_streamed(device: Device) -> None:
    """The raw images of every recorded frame equal the streamed ones, bit for bit."""
    with _recorded(device) as (recording, streamed):
        path = f"{_RECORDINGS}/{recording['id']}/frames"
        first = device.read(path)["first"]
        for number in range(first, first + _FRAMES):
            _expect_streamed(device.frame(f"{path}/{number}/raw"), streamed)


def a_replay_is_those_frames_again(device: Device) -> None:
    """A recording replayed as a camera gives the same raw images, in the same order, again."""
    skip_unless(can_replay(), "no daemon to replay with: pip install 'transientcam[server]'")
    with _recorded(device) as (recording, streamed), tempfile.TemporaryDirectory() as name:
        file = Path(name) / "recording.h5"
        file.write_bytes(device.send("GET", f"{_RECORDINGS}/{recording['id']}/file").content)
        recorded = [each.array for each in streamed[-_FRAMES:]]
        with (
            replayed(file) as address,
            Device(address, timeout_s=device.timeout_s) as replay,
            replay.stream("raw") as stream,
        ):
            found = [stream.frame().array for _ in range(_FRAMES + 1)]
    begin = next((k for k, each in enumerate(recorded) if np.array_equal(each, found[0])), None)
    expect(begin is not None, "the first replayed frame is none of those that were streamed")
    for index, array in enumerate(found, start=begin or 0):
        same = np.array_equal(array, recorded[index % _FRAMES])
        expect(same, f"replayed frame {index - (begin or 0)} differs from the streamed one")


@contextmanager
def _recorded(device: Device) -> Iterator[tuple[dict[str, Any], list[Frame]]]:
    """Record some frames while they are streamed; delete the recording at the end."""
    with _deletable(device) as ids, device.capturing(), device.stream("raw") as stream:
        stream.frame()
        running = _start(device, ids, frames=_FRAMES)
        streamed: list[Frame] = []
        notices: list[Notice] = []
        while not (notices and notices[-1].kind == "recording-stopped"):
            match stream.receive():
                case Frame() as frame:
                    streamed.append(frame)
                case Notice() as notice if notice.kind.startswith("recording-"):
                    notices.append(notice)
        equal(notices[0].kind, "recording-started", "the first notice")
        for notice in notices:
            equal(notice.details.get("recording"), running["id"], f"`recording` of {notice.kind}")
        path = f"{_RECORDINGS}/{running['id']}"
        device.wait_until(
            lambda: device.read(path)["state"] == "complete", "the recording is not complete"
        )
        yield device.read(path), streamed


def _expect_streamed(recorded: Frame, streamed: list[Frame]) -> None:
    time_s = recorded.meta["device_time_s"]
    found = [each for each in streamed if each.meta["device_time_s"] == time_s]
    expect(found, f"no streamed frame began at {time_s} s, as a recorded one did")
    same = np.array_equal(recorded.array, found[0].array)
    expect(same, f"the raw images of {time_s} s differ between recording and stream")


def _start(device: Device, ids: list[str], *, frames: int | None) -> dict[str, Any]:
    body: dict[str, Any] = {"name": "conformance", "annotations": _ANNOTATIONS}
    body |= {} if frames is None else {"frames": frames}
    response = device.send("POST", _RECORDINGS, json=body)
    skip_unless(response.status_code != 409, "a recording runs already")
    skip_unless(response.status_code != 507, "the disk of the service takes no recording")
    running = device.document(response, status=201)
    ids.append(running["id"])
    return running


@contextmanager
def _deletable(device: Device) -> Iterator[list[str]]:
    """Delete recordings at the end; without permission to do so, none is made."""
    device.require_product("raw")  # without images there is nothing to record
    probe = device.send("DELETE", f"{_RECORDINGS}/none")
    skip_unless(probe.status_code == 404, "this token may not delete what would be recorded")
    ids: list[str] = []
    with device.control():
        try:
            yield ids
        finally:
            for each in ids:
                device.send("POST", f"{_RECORDINGS}/{each}/stop")
                device.document(device.send("DELETE", f"{_RECORDINGS}/{each}"))
                gone = device.send("GET", f"{_RECORDINGS}/{each}")
                device.refusal(gone, 404, "unknown-recording")
