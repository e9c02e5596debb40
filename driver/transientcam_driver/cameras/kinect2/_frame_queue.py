"""Frames on their way from the thread of a link to the thread that reads them."""

import threading
from collections import deque
from typing import Final, NamedTuple

from transientcam_driver.camera import Counters
from transientcam_driver.cameras.kinect2._layout import MEASURED
from transientcam_driver.cameras.kinect2._packets import Assembler, SubImages
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraError

ROOM_FRAMES: Final = 4
"""Of 2.7 MB each."""


class Arrival(NamedTuple):
    """A frame, and when it was complete."""

    sub_images: SubImages
    now_s: float
    unix_s: float
    """``now_s``, ``unix_s``: by the clock of the camera."""
    lost: int
    """Images that are missing between the frame handed over before and this one."""


class FrameQueue:
    """Takes packets on one thread, and hands over frames on another.

    A frame for which there is no room replaces the oldest one, which counts as lost.

    ``counters``: counts images, losses, incomplete frames, and stretches that were no image
    (``resyncs``).
    ``clock``: of the times of arrival.
    """

    def __init__(self, counters: Counters, clock: Clock) -> None:
        self._counters = counters
        self._clock = clock
        self._arrived = threading.Condition()
        self._assembler = Assembler()
        self._frames: deque[Arrival] = deque()
        self._ended = False
        self._failure: CameraError | None = None

    def restart(self) -> None:
        """Begin anew: what was collected is dropped, and does not count as lost."""
        with self._arrived:
            self._assembler.reset()
            self._frames.clear()
            self._ended = False
            self._failure = None

    def push(self, packet: bytes) -> None:
        """Take a packet."""
        with self._arrived:
            lost_before = self._assembler.lost
            found = self._assembler.push(packet)
            self._counters.lost += self._assembler.lost - lost_before
            self._counters.resyncs = self._assembler.torn
            self._counters.incomplete_frames = self._assembler.incomplete_frames
            if found is None:
                return
            self._counters.images += MEASURED
            now_s, unix_s = self._clock.now_s(), self._clock.unix_s()
            self._frames.append(Arrival(found, now_s, unix_s, found.lost))
            if len(self._frames) > ROOM_FRAMES:
                lost = self._frames.popleft().lost + MEASURED
                self._counters.lost += MEASURED
                self._frames[0] = self._frames[0]._replace(lost=self._frames[0].lost + lost)
            self._arrived.notify_all()

    def fail(self, error: CameraError) -> None:
        """Nothing will come any more, for this reason."""
        with self._arrived:
            self._failure = error
            self._arrived.notify_all()

    def end(self) -> None:
        """Release a reader that waits: nothing will come until `restart`."""
        with self._arrived:
            self._ended = True
            self._frames.clear()
            self._arrived.notify_all()

    def take(self, timeout_s: float) -> Arrival | None:
        """Return the next frame; None if there is none in time, or nothing will come.

        Raises CameraError: what the link failed with; frames that had arrived before are returned
        first.
        """
        with self._arrived:
            self._arrived.wait_for(
                lambda: self._frames or self._ended or self._failure is not None, timeout_s
            )
            if self._frames:
                return self._frames.popleft()
            if self._failure is not None:
                raise self._failure
            return None
