"""Frames of recordings, computed as those of the camera are, also while one is being recorded.

Everything here runs on the event loop; files are read on threads of their own. A file is open only
while it is read, since an open file could not be renamed, recovered or annotated.
"""

import asyncio
import contextlib
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

import transientcam_moments as tm
from transientcam_driver import Capabilities, RawFrame
from transientcam_server.errors import DamagedFrame, NotARecording, Problem, kinds
from transientcam_server.imaging import Frame, Pipeline, Recipe, SettingsVersion, known_intrinsics
from transientcam_server.recording._disk_threads import DiskThreads
from transientcam_server.recording._layout import Header
from transientcam_server.recording._library import Library
from transientcam_server.recording._reader import Recording
from transientcam_server.settings import LensSettings, ReconstructionSettings, dataclass_of

LATEST: Final = "latest"
MAX_TIMES: Final = 4096
"""Largest number of times in the timeline of a recording."""
SettingsChoice = Literal["recorded", "current"]
Find = Callable[[], Path]
"""Returns the present path of the file, which is renamed when it is finished."""
_OPENED: Final = 2
_FRAMES: Final = 2
_RECORDED_ID: Final = 0
"""Id, in the metadata, of settings that were not this service's."""


@dataclass(frozen=True, slots=True)
class RecordedCamera:
    """What a pipeline requires of a camera."""

    capabilities: Capabilities
    factory: None = None
    simulation: None = None


class RecordedFrames:
    """The frames of one recording, counted from 1, with results kept for the last few."""

    def __init__(
        self,
        find: Find,
        header: Header,
        pipeline: Pipeline,
        *,
        lens: LensSettings,
        disk: DiskThreads,
    ) -> None:
        self.pipeline = pipeline.beside(
            RecordedCamera(header.capabilities), sensor=recorded_sensor(header)
        )
        self._camera_pipeline = pipeline
        self._find = find
        self._disk = disk
        self._header = header
        self._lens = lens
        self._frames: OrderedDict[tuple[int, int], asyncio.Task[Frame]] = OrderedDict()

    async def frame(self, name: str, settings: SettingsChoice = "recorded") -> Frame:
        """Return a frame by its number, or the last one that was written.

        Raises Problem ``unknown-frame``, ``recording-damaged``.
        """
        number = len(await self.captured_unix_s()) if name == LATEST else int(name)
        reconstruction = self._reconstruction(settings)
        key = number, reconstruction.id
        task = self._frames.get(key)
        failed = task and task.done() and (task.cancelled() or task.exception() is not None)
        if task is None or failed:  # a frame not yet written may exist next time
            task = self.pipeline.workers.start(self._read(number, reconstruction))
            self._frames[key] = task
        self._frames.move_to_end(key)
        while len(self._frames) > _FRAMES:
            self._frames.popitem(last=False)
        return await asyncio.shield(task)

    async def captured_unix_s(self) -> NDArray[np.float64]:
        """Return when each of the frames that were written so far arrived, Unix time."""
        return await self._disk.run(_read_times, self._find)

    async def _read(self, number: int, reconstruction: SettingsVersion) -> Frame:
        raw = await self._disk.run(_read_frame, self._find, number)
        recipe = recorded_recipe(self._header, reconstruction, lens=self._lens)
        previous = None
        if recipe.fills and number > 1:
            previous = await self._disk.run(_read_frame, self._find, number - 1)
        return self.pipeline.recorded_frame(number, raw, recipe, previous=previous, past=True)

    def _reconstruction(self, settings: SettingsChoice) -> SettingsVersion:
        """Return the recorded settings, if this version has them all, or the present ones."""
        if settings == "recorded":
            with contextlib.suppress(ValidationError):
                recorded = ReconstructionSettings.recorded(self._header.reconstruction)
                return SettingsVersion(_RECORDED_ID, recorded)
        return self._camera_pipeline.reconstruction


class RecordedFramesCache:
    """The frames of a library's recordings; those of the last few recordings are kept."""

    def __init__(self, library: Library, pipeline: Pipeline, *, lens: LensSettings) -> None:
        self._library = library
        self._pipeline = pipeline
        self._lens = lens
        self._opened: OrderedDict[str, RecordedFrames] = OrderedDict()

    async def opened(self, recording_id: str) -> RecordedFrames:
        """Return the frames of a recording, whole or still being written.

        Raises Problem ``unknown-recording``, ``recording-unfinished`` (while it is being
        recovered), or ``recording-damaged``.
        """
        find = partial(self._library.find, recording_id)
        disk = self._library.disk
        await disk.run(find)  # raises if it was deleted since
        found = self._opened.get(recording_id)
        if found is None:
            header = await disk.run(_read_header, find)
            found = RecordedFrames(find, header, self._pipeline, lens=self._lens, disk=disk)
            self._opened[recording_id] = found
        self._opened.move_to_end(recording_id)
        while len(self._opened) > _OPENED:
            self._opened.popitem(last=False)
        return found


def timeline(captured_s: NDArray[Any]) -> dict[str, Any]:
    """Return when the frames of a recording were captured, in at most `MAX_TIMES` numbers."""
    count = len(captured_s)
    since_s = captured_s - captured_s[0] if count else captured_s
    duration_s = float(since_s[-1]) if count else 0.0
    step = max(1, -(-count // MAX_TIMES))
    return {
        "first": 1 if count else None,
        "last": count or None,
        "count": count,
        "duration_s": duration_s,
        "frame_rate_hz": (count - 1) / duration_s if duration_s > 0.0 else None,
        "host_time_s": float(captured_s[0]) if count else None,
        "times_s": [round(float(each), 6) for each in since_s[::step]],
        "times_step": step,
    }


# -- on threads of the disk --------------------------------------------------------------------


def _read_header(find: Find) -> Header:
    with open_found(find) as recording:
        return recording.header


def _read_times(find: Find) -> NDArray[np.float64]:
    with open_found(find) as recording:
        return recording.captured_unix_s


def _read_frame(find: Find, number: int) -> RawFrame:
    with open_found(find) as recording:
        if not 1 <= number <= recording.frames:
            raise _unknown_frame(number, recording.frames)
        try:
            return recording.frame(number - 1)
        except DamagedFrame as error:
            detail = f"Frame {number} cannot be read: {error.reason}."
            raise Problem(kinds.RECORDING_DAMAGED, detail, field="frame", value=number) from error


def open_found(find: Find) -> Recording:
    """Open the file that ``find`` returns, also one that is finished, and renamed, this moment.

    Raises Problem: those of ``find``, and ``recording-damaged``.
    """
    try:
        try:
            return Recording(find())
        except FileNotFoundError:  # it was finished, and got its name, this moment
            return Recording(find())
    except (NotARecording, OSError) as error:
        raise Problem(kinds.RECORDING_DAMAGED, "The file cannot be read as one.") from error


def _unknown_frame(number: int, last: int) -> Problem:
    there = f"it has frames 1 to {last}" if last else "it has none yet"
    return Problem(
        kinds.UNKNOWN_FRAME,
        f"The recording has no frame {number}; {there}.",
        field="frame",
        value=number,
        limit=f"from 1 to {last}" if last else None,
        first=1 if last else None,
        last=last or None,
    )


def recorded_sensor(header: Header) -> tm.noise.Sensor | None:
    """Return the sensor whose noise a recording's images have; None where it says none."""
    with contextlib.suppress(ValueError):
        return dataclass_of(tm.noise.Sensor, header.camera.get("sensor"))
    return None


def recorded_recipe(
    header: Header, reconstruction: SettingsVersion, *, lens: LensSettings | None = None
) -> Recipe:
    """Return the recipe that reconstructs a recording's frames."""
    capabilities = header.capabilities
    return Recipe(
        header.applied,
        reconstruction.settings,
        2.0**capabilities.bits - 1.0,
        header.gains,
        reconstruction.id,
        known_intrinsics(
            lens or LensSettings(),
            width=capabilities.width,
            height=capabilities.height,
            recorded=header.camera.get("intrinsics"),
        ),
        recorded_sensor(header),
    )
