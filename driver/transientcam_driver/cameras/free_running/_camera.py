"""A `Camera` of a device that captures by itself."""

import math
import threading
from collections.abc import Callable
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import (
    AppliedSequence,
    Capabilities,
    FactoryCalibration,
    RawFrame,
    finite,
)
from transientcam_driver.cameras.free_running._frequencies import common_base
from transientcam_driver.cameras.free_running._measurement import Capture, Description
from transientcam_driver.cameras.free_running._rendering import BITS, Renderer
from transientcam_driver.cameras.streamed import SLOW_S, StreamedCamera, same
from transientcam_driver.errors import CameraError, CameraLost, ProtocolError
from transientcam_driver.sequence import Sampling
from transientcam_supervisor import OffSwitch

RECEIVE_S: Final = 0.1
"""How long a device is waited for in one go, and so a stop."""
_MOST_TAKES: Final = 16
_SILENT_PERIODS: Final = 5.0
_HANGS_S: Final = 1.0
"""A ``receive`` that has not returned by then is left behind: the light must go off."""


class FreeRunningDevice(Protocol):
    """A device that is connected, its light off.

    Calls come from one thread at a time, but for ``receive``, which may run beside
    ``temperature_c`` and ``light_off``. Each raises `CameraLost` where the device does not answer,
    and another `CameraError` where it refuses.
    """

    @property
    def description(self) -> Description:
        """What it is and measures; constant."""
        ...

    @property
    def off_switch(self) -> OffSwitch:
        """How another process switches the light off; ``OffSwitch()`` where none can."""
        ...

    def start(self, exposure_s: float) -> None:
        """Switch the light on and capture, with this exposure where it can be set."""

    def receive(self, timeout_s: float) -> Capture | None:
        """Return the next whole frame since the start, or None if it takes longer."""
        ...

    def temperature_c(self) -> float | None:
        """Ask for the temperature, by which the device also shows that it is there."""
        ...

    def light_off(self) -> None:
        """Stop, and switch the light off; also where it was not started."""

    def close(self) -> None:
        """Give the device back, its light off; never fails."""


class FreeRunningCamera(StreamedCamera[FreeRunningDevice, Capture]):
    """A `Camera` of a device that captures by itself; ``takes`` of its frames make one here.

    A thread takes each frame once it comes. Where none reads them the newest is kept: the next
    frame says how many were lost, here and in the device, by its own numbers. Frames have the times
    of the device.

    Parameters
    ----------
    connect
        Connects to the device, also after a loss. Raises a `CameraError`.
    others
        As of `StreamedCamera`: ``clock``, ``silence_s``, ``unread_s``.

    Raises
    ------
    CameraError
        As ``connect``; `ProtocolError` where the description is not possible.
    """

    def __init__(self, connect: Callable[[], FreeRunningDevice], **others: Any) -> None:
        self._arrived = threading.Condition()
        self._kept: Capture | CameraLost | None = None
        self._receiving: tuple[threading.Thread, threading.Event] | None = None
        self._takes: list[tuple[Capture, NDArray[np.uint16]]] = []
        self._expected: int | None = None  # the device's number of the next frame
        self._number = self._lost = 0
        self._spoilt = ""  # why the last frame was not whole
        self._clocks_s = 0.0, 0.0  # of the device and of this machine, at its last frame
        # `receive` has a thread of its own, which is left behind where it hangs
        limits_s = {"start": SLOW_S, "receive": math.inf}
        connected = same(connect, lambda device: device.description.serial, limits_s=limits_s)
        super().__init__(connected, **others)

    def _describe(self) -> None:
        about = self._device.description
        self._renderer = Renderer(about)
        self._capabilities = capabilities_of(about, self._renderer)
        # slow cameras have time for some frames
        self._silence_s = max(self._silence_s, _SILENT_PERIODS / about.frame_rate_hz)
        made = self._renderer
        self.factory = FactoryCalibration(made.gains, about.lens, made.sensor, about.extrinsics)

    @property
    def off_switch(self) -> OffSwitch:
        """As the device states it."""
        return self._device.off_switch

    def device_time_s(self) -> float:
        """Time of the device's last frame, and what has passed since it came."""
        device_s, here_s = self._clocks_s
        return device_s + self._clock.now_s() - here_s

    def _check(self) -> float | None:
        return self._device.temperature_c()

    def _silence(self) -> str:
        return self._spoilt or f"{self._number} frames since it was opened"

    def _set(self, applied: AppliedSequence) -> None:
        again = self._lit and applied.sequence.exposure_s != self._applied.sequence.exposure_s
        if again:
            self._end()
        super()._set(applied)
        self._takes, self._kept = [], None
        if again:
            self._begin()

    def _begin(self) -> None:
        self._kept, self._expected, self._takes = None, None, []
        self._device.start(self._applied.sequence.exposure_s)
        ended = threading.Event()
        thread = threading.Thread(
            target=self._receive, args=(self._device, ended), name="free-running", daemon=True
        )
        self._receiving = thread, ended
        thread.start()

    def _end(self) -> None:
        if self._receiving is not None:
            self._receiving[1].set()
        try:
            self._device.light_off()
        finally:
            self._release_reader()

    def _release_reader(self) -> None:
        receiving, self._receiving = self._receiving, None
        if receiving is not None:
            receiving[1].set()
            receiving[0].join(_HANGS_S)
        with self._arrived:
            self._kept = None
            self._arrived.notify_all()

    def _take(self, timeout_s: float) -> Capture | None:
        with self._arrived:
            self._arrived.wait_for(
                lambda: self._kept is not None or self._receiving is None, timeout_s
            )
            found, self._kept = self._kept, None
        if isinstance(found, CameraLost):
            raise found
        return found

    def _collected(self, arrival: Capture) -> RawFrame | None:
        capture, applied = arrival, self._applied
        each = applied.images // applied.sequence.takes
        missing = 0 if self._expected is None else max(0, capture.number - self._expected)
        self._expected = capture.number + 1
        try:
            self._takes.append((capture, self._renderer.images(capture)))
            self.counters.images += each
        except (ProtocolError, TypeError, ValueError) as error:  # costs this frame alone
            missing, self._spoilt = missing + 1, f"frames that do not fit: {error}"
        self.counters.lost += missing * each
        self._lost += missing * each
        self._number += missing
        if len(self._takes) < applied.sequence.takes:
            return None
        (first, _), made = self._takes[0], [images for _, images in self._takes]
        self._takes = []
        period_s = 1 / self._device.description.frame_rate_hz
        last_s = period_s if capture.capture_s is None else capture.capture_s
        frame = RawFrame(
            number=self._number,
            epoch=applied.epoch,
            images=np.concatenate(made) if len(made) > 1 else made[0],
            labels=applied.labels,
            device_time_s=first.device_time_s,
            host_time_s=self._clock.unix_s(),
            capture_s=max(0.0, capture.device_time_s - first.device_time_s) + last_s,
            temperature_c=finite(capture.temperature_c),
            lost_images=self._lost,
        )
        self._lost = 0
        self._number += 1
        return frame

    def _receive(self, device: FreeRunningDevice, ended: threading.Event) -> None:
        while not ended.is_set():
            found: Capture | CameraLost | None
            try:
                came: object = device.receive(RECEIVE_S)  # of a plug-in: anything
                if not isinstance(came, Capture | None):
                    raise CameraLost(f"{came!r:.60} is no Capture")
                found = came
            except CameraError as error:
                found = error if isinstance(error, CameraLost) else CameraLost(str(error))
            if found is None:
                continue
            with self._arrived:
                if ended.is_set():
                    return
                self._kept = found
                if isinstance(found, Capture):
                    self._clocks_s = found.device_time_s, self._clock.now_s()
                self._arrived.notify_all()
            if isinstance(found, CameraLost):
                return


def capabilities_of(about: Description, renderer: Renderer) -> Capabilities:
    """Return what a sequence can ask of a device: takes, and its exposure where that can be set."""
    frequencies_hz = [each.frequency_hz for each in about.measurements]
    base_hz, multiples = common_base(frequencies_hz, about.max_range_m)
    images = len(multiples) * len(renderer.phases_rad)
    period_s = 1 / (about.frame_rate_hz * images)
    exposure_s = min(getattr(about.measurements[0], "exposure_s", period_s), period_s)
    least_s = about.min_exposure_s or exposure_s
    return Capabilities(
        model=about.model, serial=about.serial, firmware=about.firmware, protocol_version=2,
        width=about.width, height=about.height, bits=BITS, readout_s=period_s - exposure_s,
        streaming_readout_s=period_s - exposure_s, tuning_step_hz=base_hz, min_frequency_hz=base_hz,
        max_frequency_hz=base_hz * multiples[-1], max_harmonics=len(multiples),
        min_exposure_s=least_s, max_exposure_s=about.max_exposure_s or max(least_s, exposure_s),
        max_takes=_MOST_TAKES, sampling=Sampling(multiples, renderer.phases_rad, about.max_range_m),
        dark_dn=renderer.dark_dn, heartbeat_s=about.heartbeat_s, clock=about.clock,
    )  # fmt: skip
