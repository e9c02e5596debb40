"""A `Camera` of a device that exposes on request."""

import math
import threading
from collections.abc import Callable
from contextlib import suppress
from itertools import groupby
from typing import Final

import numpy as np

from transientcam_driver.camera import (
    AppliedSequence,
    CameraState,
    Capabilities,
    FactoryCalibration,
    RawFrame,
    Simulation,
    finite,
)
from transientcam_driver.cameras.streamed import StreamedCamera, same
from transientcam_driver.cameras.triggered._device import Group, Images, TriggeredDevice
from transientcam_driver.clock import Clock, RealClock
from transientcam_driver.errors import CameraError, CameraLost, ImagesLost
from transientcam_driver.sequence import ImageLabel
from transientcam_supervisor import OffSwitch

_LOSSES: Final = 5
"""Losses in a row from which on the camera counts as lost, with the reason."""
_HIGHEST_DN: Final = 65535
_LONGEST_SETTLING_S: Final = 60.0
_SHORTEST_S: Final = 1e-9  # where the clock does not move meanwhile


class PartialFrame:
    """Collects the images of one frame, group by group.

    ``settled_s``: when the device is ready for the next group; None before it was prepared.
    ``exposing``: whether images of the next group were asked for.
    ``begun_s``: when the first ones were asked for.
    """

    def __init__(self, applied: AppliedSequence, capabilities: Capabilities) -> None:
        self.applied = applied
        self.labels = applied.labels
        self.images = np.empty(
            (len(self.labels), capabilities.height, capabilities.width), np.uint16
        )
        self._left = [tuple(group) for _, group in groupby(self.labels, _of_group)]
        self.settled_s: float | None = None
        self.exposing = False
        self.begun_s: float | None = None

    @property
    def next_group(self) -> Group:
        """The images that are captured next."""
        return self._left[0]

    @property
    def complete(self) -> bool:
        """Whether all images are there."""
        return not self._left

    def store(self, images: Images) -> None:
        """Take the images of the next group. Raises ValueError where they are no such ones."""
        images = np.asarray(images)
        wanted = len(self._left[0]), *self.images.shape[1:]
        if images.shape != wanted or images.dtype.kind not in "buif":
            raise ValueError(f"{images.shape} of {images.dtype}; allowed: {wanted} of uint16")
        if images.dtype != np.uint16 and not (images.min() >= 0 and images.max() <= _HIGHEST_DN):
            raise ValueError(f"values beyond 0 to {_HIGHEST_DN}")
        self.images[[label.index for label in self._left[0]]] = images
        self._left.pop(0)
        self.settled_s, self.exposing = None, False


def _of_group(label: ImageLabel) -> tuple[int, int]:
    return label.take, label.harmonic


_Arrival = tuple[PartialFrame, Images | ImagesLost]


class TriggeredCamera(StreamedCamera[TriggeredDevice, _Arrival]):
    """A `Camera` of a device that exposes on request.

    A frame with a lost image is dropped as a whole; the next one has their number. Where nothing
    else than losses comes, the camera is lost. Nothing is
    exposed, and so no light is on, unless ``read_frame`` is called.

    Parameters
    ----------
    connect
        Connects to the device, also after a loss. Raises a `CameraError`.
    clock
        Real time by default.
    simulation
        The handle on a simulated camera, whose lens is then known; None for a real one.
    on_close
        Called once the device was given back.

    Raises
    ------
    CameraError
        As ``connect``.
    """

    def __init__(
        self,
        connect: Callable[[], TriggeredDevice],
        *,
        clock: Clock | None = None,
        simulation: Simulation | None = None,
        on_close: Callable[[], None] = lambda: None,
    ) -> None:
        self._on_close = on_close
        self._number = self._losses = self._lost = 0
        clock = clock or RealClock()
        super().__init__(
            same(connect, lambda device: device.capabilities.serial, simulation),
            clock=clock,
            simulation=simulation,
            silence_s=math.inf,
            unread_s=math.inf,  # nothing is exposed without a reader
            now_s=clock.now_s,
        )

    def _describe(self) -> None:
        self._changed = threading.Condition(self._control)
        self._capabilities = self._device.capabilities
        width, height = self._capabilities.width, self._capabilities.height
        lens = None if self.simulation is None else self.simulation.lens(width=width, height=height)
        stated = getattr(self._device, "factory", None)
        self.factory = stated if lens is None else FactoryCalibration(lens=lens)

    @property
    def off_switch(self) -> OffSwitch:
        """As the device states it."""
        return self._device.off_switch

    def close(self) -> None:
        """Expose nothing more and give the device back; may be called twice."""
        closed = self._closed
        super().close()
        if not closed:
            self._on_close()

    # --- under _control ----------------------------------------------------------------------

    def _check(self) -> float:
        return self._device.temperature_c()

    def _set(self, applied: AppliedSequence) -> None:
        self._device.configure(applied)
        super()._set(applied)
        self._begin()
        self._changed.notify_all()

    def _begin(self) -> None:
        """Drop what was captured of the present frame."""
        self._partial = PartialFrame(self._applied, self._capabilities)

    def _end(self) -> None:
        self._begin()
        self._changed.notify_all()
        self._device.light_off()

    def _release_reader(self) -> None:
        self._changed.notify_all()
        if self._lit:
            with suppress(CameraError):
                self._device.light_off()

    def _lose(self) -> None:
        """Mark the device as gone; a reading thread may still use it."""
        self._state, self._lit = CameraState.DISCONNECTED, False

    # --- frames ------------------------------------------------------------------------------

    def _take(self, timeout_s: float) -> _Arrival | None:
        partial = self._step(timeout_s)
        if partial is None:
            return None
        try:
            images = self._device.receive(timeout_s)
        except ImagesLost as error:
            return partial, error
        return None if images is None else (partial, images)

    def _step(self, timeout_s: float) -> PartialFrame | None:
        """Do what is due next; return the frame that images are on their way for."""
        with self._control:
            if self._state is not CameraState.STREAMING:
                return None
            partial, end_s = self._partial, self._clock.now_s() + timeout_s
            if partial.settled_s is None:
                settles_s = self._asked(lambda: self._prepared(partial.next_group))
                partial.settled_s = self._clock.now_s() + settles_s
            now_s = self._clock.now_s()
            if now_s < partial.settled_s:
                wait_s = min(partial.settled_s, end_s) - now_s
                self._clock.wait(self._changed, max(0.0, wait_s))
                return None
            if not partial.exposing:
                if partial.begun_s is None:
                    partial.begun_s = now_s
                self._asked(lambda: self._device.trigger(partial.next_group))
                partial.exposing = True
            return partial

    def _prepared(self, group: Group) -> float:
        found = self._device.prepare(group)
        settles_s = finite(found)
        if settles_s is None or not 0 <= settles_s <= _LONGEST_SETTLING_S:
            limit = f"no number of seconds from 0 to {_LONGEST_SETTLING_S:g}"
            raise CameraLost(f"prepare() returned {found!r:.60}, {limit}")
        return settles_s

    def _collected(self, arrival: _Arrival) -> RawFrame | None:
        partial, images = arrival
        if partial is not self._partial:  # stopped or set anew meanwhile
            return None
        if isinstance(images, ImagesLost):
            self._drop(partial, images)
            return None
        try:
            partial.store(images)
        except (TypeError, ValueError) as error:
            self._drop(partial, ImagesLost(f"what receive() returned does not fit: {error}"))
            return None
        self._losses = 0
        self.counters.images += len(images)
        return self._delivered(partial) if partial.complete else None

    def _drop(self, partial: PartialFrame, error: ImagesLost) -> None:
        lost = len(partial.next_group)
        self.counters.lost += lost
        self.counters.incomplete_frames += 1
        self._lost += lost
        self._losses += 1
        self._number += 1
        self._begin()
        if self._losses >= _LOSSES:
            self._losses = 0
            self._lose()
            raise CameraLost(f"{_LOSSES} times in a row {error}") from error

    def _delivered(self, partial: PartialFrame) -> RawFrame:
        assert partial.begun_s is not None  # noqa: S101  (it is complete)
        frame = RawFrame(
            number=self._number,
            epoch=partial.applied.epoch,
            images=partial.images,
            labels=partial.labels,
            device_time_s=partial.begun_s - self._since_s,
            host_time_s=self._clock.unix_s(),
            capture_s=max(self._clock.now_s() - partial.begun_s, _SHORTEST_S),
            temperature_c=finite(self._asked(self._device.temperature_c)),
            lost_images=self._lost,
        )
        self._lost = 0
        self._number += 1
        self._begin()
        return frame
