"""From what arrived to frames: decoded, so many takes in one, with the camera's times."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import AppliedSequence, RawFrame
from transientcam_driver.cameras.kinect2 import _codes as codes
from transientcam_driver.cameras.kinect2._abilities import FRAME_RATE_HZ
from transientcam_driver.cameras.kinect2._frame_queue import Arrival
from transientcam_driver.cameras.kinect2._packets import TICK_S

_TICKS: Final = 1 << 32


class FrameMaker:
    """Decodes what arrived, and collects takes; between two of them some may be lost.

    Times are those of the stream's timestamps. Since no request for the camera's clock is known,
    the first frame of a run has the time of its arrival, less what a frame takes.

    ``since_s``: when the camera was opened: the zero of ``device_time_s``.
    """

    def __init__(self, since_s: float) -> None:
        self._since_s = since_s
        self._takes: list[tuple[float, NDArray[np.uint16]]] = []
        self._number = 0
        self._lost = 0
        self._time_s = 0.0
        self._timestamp: int | None = None

    def restart(self) -> None:
        """Begin a new run: numbers and times go on growing."""
        self.drop()
        self._timestamp = None

    def drop(self) -> None:
        """Begin the frame anew, as for another sequence."""
        self._takes = []

    def push(self, arrival: Arrival, applied: AppliedSequence) -> RawFrame | None:
        """Add what arrived; return the frame that it completes, if any."""
        begin_s = self._begin_s(arrival)
        self._lost += arrival.lost
        self._number += -(-arrival.lost // applied.images)
        self._takes.append((begin_s, codes.frame_images(arrival.sub_images.data)))
        if len(self._takes) < applied.sequence.takes:
            return None
        first_s, images = self._takes[0]
        if len(self._takes) > 1:
            images = np.concatenate([each for _, each in self._takes])
        frame = RawFrame(
            number=self._number,
            epoch=applied.epoch,
            images=images,
            labels=applied.labels,
            device_time_s=first_s,
            host_time_s=arrival.unix_s,
            capture_s=begin_s - first_s + 1 / FRAME_RATE_HZ,
            temperature_c=None,  # no request for one is known
            lost_images=self._lost,
        )
        self._number += 1
        self._lost = 0
        self._takes = []
        return frame

    def _begin_s(self, arrival: Arrival) -> float:
        """Return when a frame began."""
        timestamp, last = arrival.sub_images.timestamp, self._timestamp
        self._timestamp = timestamp
        step = 0 if last is None else max(1, (timestamp - last) % _TICKS)
        if last is None or step > _TICKS // 2:  # the stream began anew
            arrived_s = arrival.now_s - self._since_s - 1 / FRAME_RATE_HZ
            self._time_s = max(arrived_s, self._time_s + TICK_S)
        else:
            self._time_s += step * TICK_S
        return self._time_s
