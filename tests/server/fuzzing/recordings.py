"""Crafted recordings in a service's directory: listed, described, read, replayed, deleted.

``python -m tests.server.fuzzing.recordings DIRECTORY FIRST LAST EVERY`` tries these cases in
a process that libhdf5 may crash, and writes a line of JSON before and after each. Every so many
cases it goes over HTTP, else straight to what answers there.
"""

import asyncio
import contextlib
import json
import os
import random
import resource
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import h5py
import httpx
import numpy as np
from fastapi import FastAPI

from tests.server.fuzzing.damage import DAMAGES, lookup3
from tests.server.fuzzing.forgery import BOMB_BYTES, FORGERIES, bomb
from tests.server.recording.made import (
    APPLIED,
    HEIGHT,
    WIDTH,
    frame,
    header,
    record,
    rewrite_texts_at_the_end,
)
from transientcam_driver import DriverError, open_camera
from transientcam_server.api import build_app
from transientcam_server.api._documents.recording import document
from transientcam_server.errors import RecordingError
from transientcam_server.recording import Library, RecordingWriter, ReplayCamera, recover
from transientcam_server.settings import CalibrationSettings, RecordingSettings, Settings

FRAMES: Final = 3
NAME: Final = "case"
GOOD: Final = "good"
ADDRESS: Final = f"/api/v1/recordings/{NAME}"
MEMORY_BYTES: Final = 2 * 1024**3
"""May be taken beyond what there is before the first case, by the kernel's own limit."""
BEYOND_BYTES: Final = 64 * 1024**2
"""More than any case has to take: the largest chunk of a series and a frame."""
MOST_SPENT_S: Final = 60.0
"""Of processor time: the kernel ends a process that takes more for one case."""
READS: Final = (
    "frames",
    "frames/1",
    "frames/1/raw.npy",
    "frames/3/range.npy",
    "frames/latest/pixels/1/1",
)
KINDS: Final = (*DAMAGES, *FORGERIES)


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes
    ----------
    state
        What the list says of it.
    wrong
        Whatever should not have happened.
    grown_bytes
        The most memory beyond what was there before it.
    spent_s
        The processor time of what was done with it.
    """

    kind: str
    state: str
    wrong: list[str]
    grown_bytes: int
    spent_s: float


def in_memory() -> str | None:
    """Return a directory whose files are in memory, where the system has one."""
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


def seeds(directory: Path) -> list[Path]:
    """Make what cases are made of: whole, calibrated, rewritten and unfinished recordings."""
    directory.mkdir(parents=True, exist_ok=True)
    planes = np.exp(1j * np.arange(3 * HEIGHT * WIDTH)).reshape(3, HEIGHT, WIDTH)
    bad = np.zeros((HEIGHT, WIDTH), bool)
    whole = record(directory / "whole.h5", FRAMES, annotations={"who": "Åsa"})
    calibrated = record(
        directory / "calibrated.h5",
        FRAMES,
        calibration_planes=planes.astype(np.complex64),
        calibration_bad=bad,
    )
    rewritten = record(directory / "rewritten.h5", FRAMES)
    rewrite_texts_at_the_end(rewritten)
    writer = RecordingWriter(directory / "left.h5", header())
    for number in range(FRAMES):
        writer.append(frame(number))
    unfinished = directory / "unfinished.h5.part"
    unfinished.write_bytes(writer.part.read_bytes())
    writer.close({})
    writer.path.unlink()
    return [whole, calibrated, rewritten, unfinished]


def forge(seed: Path, target: Path, kind: str, draw: random.Random) -> None:
    """Write a case of one kind; an unfinished one is made of an unfinished seed."""
    if kind in DAMAGES:
        target.write_bytes(DAMAGES[kind](seed.read_bytes(), draw))
        return
    shutil.copyfile(seed, target)
    if seed.name.endswith(".part"):
        _mark_closed(target)
    with h5py.File(target, "r+") as file:
        for _ in range(draw.choice((1, 1, 1, 3))):
            with contextlib.suppress(Exception):  # h5py refuses some of it
                FORGERIES[kind](file, draw, target.parent)


def _mark_closed(path: Path) -> None:
    """Clear the superblock's mark that it is open for writing, so that h5py may rewrite it."""
    data = bytearray(path.read_bytes())
    data[11] = 0
    data[28:36] = len(data).to_bytes(8, "little")  # the end of the allocated space
    data[44:48] = lookup3(bytes(data[:44])).to_bytes(4, "little")
    path.write_bytes(data)


class Subject:
    """A service that captures nothing, whose directory has one good recording and one case."""

    def __init__(self, directory: Path) -> None:
        self.kept = directory / "kept"
        self.kept.mkdir(parents=True)
        self._seeds = seeds(directory / "seeds")
        shutil.copyfile(self._seeds[0], self.kept / f"{GOOD}.h5")
        shutil.copyfile(self._seeds[0], self.kept / "other.h5")
        self._camera = open_camera("sim:wall?noise=off")
        settings = Settings(
            camera="sim:wall?noise=off",
            recordings=RecordingSettings(directory=self.kept),
            calibrations=CalibrationSettings(directory=directory),
        )
        self._app: FastAPI = build_app(self._camera, settings)
        self._library: Library = self._app.state.service.recordings

    def close(self) -> None:
        """Close the camera, and end the workers."""
        self._app.state.service._executor.shutdown()
        self._camera.close()

    async def attempt(self, number: int, *, over_http: bool) -> Outcome:
        """Make a case and do with it all that a client can."""
        draw = random.Random(number)
        kind = KINDS[number % len(KINDS)]
        seed = draw.choice(self._seeds)
        target = self.kept / (NAME + ".h5" + (".part" if seed.name.endswith(".part") else ""))
        forge(seed, target, kind, draw)
        wrong: list[str] = []
        before_bytes, begin_s = _reset_peak(), time.process_time()
        state = await self._read_over_http(wrong) if over_http else self._read(wrong)
        if state != "damaged" or draw.random() < 0.25:  # of these each takes the same way out
            wrong += _replayed(target)
        if target.name.endswith(".part") and draw.random() < 0.25:
            with _only(wrong, "recover", RecordingError, OSError):
                recover(target)
        await self._delete(wrong, over_http=over_http)
        grown, spent_s = _peak_bytes() - before_bytes, time.process_time() - begin_s
        for left in self.kept.glob(f"{NAME}*"):
            wrong.append(f"{left.name} is left")
            left.unlink()
        return Outcome(kind, state, wrong, grown, round(spent_s, 4))

    async def _read_over_http(self, wrong: list[str]) -> str:
        async with self._client() as client:
            listed = await client.get("/api/v1/recordings")
            _expect(listed, {200}, wrong)
            found = listed.json()["recordings"] if listed.status_code == 200 else []
            _expect(await client.get(ADDRESS), {200}, wrong)
            for path in READS:
                _expect(await client.get(f"{ADDRESS}/{path}"), {200, 404, 409}, wrong)
        return _state(found, wrong)

    def _read(self, wrong: list[str]) -> str:
        found: list[Any] = []
        with _only(wrong, "list"):
            found = [document(each) for each in self._library.describe_all()]
            for each in found:
                _require_json(each.model_dump_json())
        with _only(wrong, "describe"):
            document(self._library.describe(NAME))
        return _state([{"id": each.id, "state": each.state} for each in found], wrong)

    async def _delete(self, wrong: list[str], *, over_http: bool) -> None:
        if not over_http:
            with _only(wrong, "delete"):
                self._library.delete(NAME)
            return
        async with self._client() as client:
            _expect(await client.delete(ADDRESS), {200}, wrong)
            _expect(await client.get(ADDRESS), {404}, wrong)

    def _client(self) -> httpx.AsyncClient:
        transport = httpx.ASGITransport(self._app, raise_app_exceptions=False)
        return httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8000")


def _state(found: list[dict[str, Any]], wrong: list[str]) -> str:
    states = {each["id"]: str(each["state"]) for each in found}
    if states.get(GOOD) != "complete":
        wrong.append(f"the good one is {states.get(GOOD)}")
    if NAME not in states:
        wrong.append("it is not listed")
    return states.get(NAME, "not listed")


def _expect(answer: httpx.Response, wanted: set[int], wrong: list[str]) -> None:
    if answer.status_code not in wanted:
        wrong.append(f"{answer.request.method} {answer.request.url.path}: {answer.status_code}")
        return
    if "json" in answer.headers["Content-Type"]:
        with _only(wrong, str(answer.request.url.path)):
            _require_json(answer.content)


def _require_json(text: str | bytes) -> None:
    json.loads(text, parse_constant=_no_json)


def _no_json(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")


@contextlib.contextmanager
def _only(wrong: list[str], what: str, *errors: type[Exception]) -> Iterator[None]:
    """Note any error but those."""
    try:
        yield
    except errors:
        pass
    except Exception as error:
        wrong.append(f"{what}: {error!r}")


def _replayed(path: Path) -> list[str]:
    wrong: list[str] = []
    with _only(wrong, "replay", RecordingError, OSError, DriverError):
        camera = ReplayCamera(path, speed=float("inf"))
        try:
            camera.start()
            for _ in range(FRAMES + 1):
                raw = camera.read_frame(timeout_s=1.0)
                if raw.images.shape != (APPLIED.images, HEIGHT, WIDTH):
                    wrong.append(f"a frame of shape {raw.images.shape}")
        finally:
            camera.close()
    return wrong


def _status_bytes(field: str) -> int:
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(field):
            return 1024 * int(line.split()[1])
    raise AssertionError(field)


def _reset_peak() -> int:
    """Begin to count the peak anew, and return the present memory."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return _status_bytes("VmRSS:")


def _peak_bytes() -> int:
    return _status_bytes("VmHWM:")


async def _attempt_all(subject: Subject, first: int, last: int, every: int) -> None:
    for number in range(first, last):
        os.write(1, b'{"begin": %d}\n' % number)
        signal.setitimer(signal.ITIMER_PROF, MOST_SPENT_S)
        outcome = await subject.attempt(number, over_http=number % every == 0)
        os.write(1, json.dumps(vars(outcome) | {"number": number}).encode() + b"\n")


def main() -> None:
    """Try cases with a limit on the memory of this process."""
    directory, *numbers = sys.argv[1:]
    first, last, every = map(int, numbers)
    subject = Subject(Path(directory))
    bomb(BOMB_BYTES)
    asyncio.run(subject.attempt(0, over_http=True))  # what is loaded once is no one case's
    limit = _status_bytes("VmSize:") + MEMORY_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    asyncio.run(_attempt_all(subject, first, last, every))
    subject.close()


if __name__ == "__main__":
    main()
