"""A recording as a camera: every frame again, bit for bit, in the same order, at a chosen speed."""

import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from transientcam_driver import (
    AppliedSequence,
    Camera,
    CameraLost,
    CameraName,
    CameraPlugin,
    CameraState,
    FactoryCalibration,
    FrameTimeout,
    NotStreaming,
    RawFrame,
    Sequence,
    SequenceError,
    SpecError,
    Status,
)
from transientcam_driver.camera import HostCamera
from transientcam_driver.clock import Clock, RealClock
from transientcam_server.imaging import FACTORY_ID
from transientcam_server.recording._reader import Recording

LOOP_BYTES: Final = 256 * 1024**2
"""A looped recording of at most so many bytes of images is read once and kept in memory."""
_FAST: Final = float("inf")


@dataclass(frozen=True, slots=True)
class ReplaySpec:
    """The parts of a replay's name: ``speed`` is a factor, inf for as fast as it can be read."""

    path: Path
    speed: float = 1.0
    loop: bool = False


def parse_replay(name: CameraName) -> ReplaySpec:
    """Read ``recording:PATH[?speed=original|fast|2.0&loop=on|off]``.

    Raises SpecError naming what cannot be read.
    """
    if not name.address:
        raise SpecError(name.spec, "it names no recording")
    loop = name.choice("loop", ("off", "on")) == "on"
    return ReplaySpec(Path(name.address), _speed(name), loop)


def _speed(name: CameraName) -> float:
    text = name.options.get("speed", "original")
    named = {"original": 1.0, "fast": _FAST}
    try:
        speed = named[text] if text in named else float(text)
    except ValueError:
        speed = 0.0
    if not speed > 0.0:  # also NaN
        raise name.refused("speed", "original, fast or a factor above 0")
    return speed


class ReplayCamera(HostCamera):
    """Has the methods of `transientcam_driver.Camera`, and frames that were captured before.

    Frames come at the times of the device's clock; without ``loop`` the camera is lost after the
    last one. In a loop frame numbers and device times go on counting, as a camera's do; host
    times stay those of the recording. All frames have the epoch of the sequence, which is the
    same for all of them, also where the camera counted it anew after an unplug.
    Raises NotARecording, OSError if the file cannot be replayed.
    """

    def __init__(
        self, path: Path, *, speed: float = 1.0, loop: bool = False, clock: Clock | None = None
    ) -> None:
        super().__init__(clock or RealClock(), None)
        self._recording = Recording(path)
        header = self._recording.header
        self._capabilities, self._applied = header.capabilities, header.applied
        if header.gains is not None and header.gains.id == FACTORY_ID:
            self.factory = FactoryCalibration(header.gains.planes.astype(np.complex64, copy=False))
        self._speed = speed
        self._loop = loop
        self._changed = threading.Condition(self._control)
        self._state = CameraState.IDLE
        self._index = 0
        self._round = 0
        self._kept: dict[int, RawFrame] = {}
        self._due_s = 0.0
        self._temperature_c: float | None = None

    @property
    def off_switch(self) -> None:
        """None: there is no light."""
        return

    @property
    def intrinsics(self) -> Mapping[str, Any] | None:
        """Where the pixels of that camera look, if it was recorded."""
        return self._recording.header.camera.get("intrinsics")

    def validate(self, sequence: Sequence) -> AppliedSequence:
        """Return the sequence that was recorded, if it is the requested one.

        Raises SequenceError naming the first field that differs.
        """
        applied = self.capabilities.apply(sequence)
        recorded, requested = self.applied.sequence.to_document(), applied.sequence.to_document()
        for field, value in recorded.items():
            if requested[field] != value:
                limit = f"{value!r}: the sequence of a recording cannot be changed"
                raise SequenceError(field, requested[field], limit)
        return replace(applied, epoch=0)

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Accept the sequence that was recorded, and no other; see `validate`."""
        self.validate(sequence)
        return self.applied

    def start(self) -> None:
        """Go on with the next frame, now."""
        with self._changed:
            self._require_open()
            self._due_s = self._clock.now_s()
            self._state = CameraState.STREAMING

    def stop(self) -> None:
        """Pause; a ``read_frame`` that is waiting raises NotStreaming."""
        with self._changed:
            self._require_open()
            if self._state is CameraState.STREAMING:
                self._state = CameraState.IDLE
            self._changed.notify_all()

    def status(self) -> Status:
        """Return the status that a device would report. Raises CameraLost after the last frame."""
        with self._changed:
            self._require_open()
            self._require_more()
            now = self._status(light_on=False, temperature_c=self._temperature_c)
            return replace(now, next_image=self._index * self.applied.images)

    def device_time_s(self) -> float:
        """Return the time of the next frame by the device's clock."""
        times = self._recording.series("device_time_s")
        if not len(times):
            return 0.0
        index = min(self._index, len(times) - 1)
        return float(times[index]) + self._round * self._length_s

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next frame, as `Camera.read_frame` does; CameraLost after the last one.

        Raises DamagedFrame where it is not what was recorded; the next call goes on after it.
        """
        with self._changed:
            end_s = self._clock.now_s() + timeout_s
            while True:
                self._require_open()
                if self._state is CameraState.DISCONNECTED:
                    raise self._over()
                if self._state is not CameraState.STREAMING:
                    raise NotStreaming(self._state)
                self._require_more()
                now_s = self._clock.now_s()
                if now_s >= self._due_s:
                    return self._take(now_s)
                if now_s >= end_s:
                    raise FrameTimeout(timeout_s)
                self._clock.wait(self._changed, min(self._due_s, end_s) - now_s)

    def reconnect(self) -> None:
        """Do nothing unless the recording is over, which stays so.

        Raises CameraLost where there are no more frames.
        """
        with self._changed:
            self._require_open()
            self._require_more()

    def close(self) -> None:
        """Close the file; may be called twice."""
        with self._changed:
            self._closed = True
            self._state = CameraState.DISCONNECTED
            self._changed.notify_all()
            self._recording.close()

    # --- under _changed --------------------------------------------------------------------

    @property
    def _length_s(self) -> float:
        """From one round to the next, by the device's clock."""
        times = self._recording.series("device_time_s")
        return float(times[-1] - times[0]) + 1.0 / self.applied.frame_rate_hz

    def _take(self, now_s: float) -> RawFrame:
        index, shift_s = self._index, self._round * self._length_s
        numbers = self._recording.series("device_frame")
        shift_frames = self._round * (int(numbers[-1]) - int(numbers[0]) + 1)
        self._advance(now_s)
        raw = self._frame(index)
        self._temperature_c = raw.temperature_c
        self.counters.frames += 1
        self.counters.images += len(raw.labels)
        self.counters.lost += raw.lost_images
        return replace(
            raw,
            epoch=self.applied.epoch,
            number=raw.number + shift_frames,
            device_time_s=raw.device_time_s + shift_s,
            captured_unix_s=None,
        )

    def _frame(self, index: int) -> RawFrame:
        found = self._kept.get(index)
        if found is None:
            found = self._recording.frame(index)
            if self._loop and found.images.nbytes * self._recording.frames <= LOOP_BYTES:
                found.images.flags.writeable = False  # every round hands out the same array
                self._kept[index] = found
        return found

    def _advance(self, now_s: float) -> None:
        """Move to the next frame and compute when it is due."""
        before_s = self.device_time_s()
        self._index += 1
        if self._index >= self._recording.frames and self._loop:
            self._index = 0
            self._round += 1
        # by schedule, so that the rate is the original's; anew when they were not read in time,
        # or the device began to count anew
        between_s = max(0.0, self.device_time_s() - before_s) / self._speed
        late = now_s - self._due_s > between_s
        self._due_s = (now_s if late else self._due_s) + between_s

    def _require_more(self) -> None:
        if self._index >= self._recording.frames:
            self._state = CameraState.DISCONNECTED
            raise self._over()

    def _over(self) -> CameraLost:
        return CameraLost(f"the recording is over after {self._recording.frames} frames")


def _open(name: CameraName, clock: Clock) -> Camera:
    replay = parse_replay(name)
    return ReplayCamera(replay.path, speed=replay.speed, loop=replay.loop, clock=clock)


PLUGIN: Final = CameraPlugin(
    summary="a recording, every frame again, bit for bit (docs/recordings.md)",
    usage="recording:FILE",
    open=_open,
    check=lambda name: Recording(parse_replay(name).path).close(),
    options={"speed": "original, fast or a factor", "loop": "on: begin anew after the last frame"},
)
