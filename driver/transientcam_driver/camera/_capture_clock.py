"""When frames were captured, in Unix time, whatever happens to the clock of the host.

The device's clock is set by the host's once: by the frame that came with the least delay. A step
of the host's clock moves nothing, and intervals are the device's. Where the device's clock begins
anew it is set once more; times go on growing all the same.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

STEP_S: Final = 1.0
"""By how much the delay of frames may differ; more is a step of the host's clock."""
SETTLED_S: Final = 10.0
"""For so long from the first frame on, one that came sooner sets the clock at once."""
MOST_DRIFT: Final = 2e-4
"""By which the clock then follows the host's, at most: a quartz is off by no more."""
_GAIN_HZ: Final = 0.25 / SETTLED_S
_AFTER_S: Final = 1e-5


class CaptureClock:
    """Times of a running capture; the first frames may still correct the clock.

    Later ones correct its rate: both clocks run apart, by seconds in a week.
    """

    def __init__(self) -> None:
        self._offset_s: float | None = None
        self._device_time_s, self._unix_s = 0.0, float("-inf")
        self._until_s, self._rate, self._least_s = 0.0, 0.0, STEP_S
        self._settled = False

    def unix_s(self, *, device_time_s: float, capture_s: float, host_time_s: float) -> float:
        """Return when the first exposure of the next frame began; times as in `RawFrame`."""
        offset_s = host_time_s - capture_s - device_time_s
        if self._offset_s is None or device_time_s <= self._device_time_s:
            self._offset_s, self._rate, self._settled = offset_s, 0.0, False
            self._until_s = device_time_s + SETTLED_S
        else:
            self._offset_s += self._rate * (device_time_s - self._device_time_s)
        late_s = offset_s - self._offset_s
        if abs(late_s) < STEP_S:
            self._least_s = min(self._least_s, late_s)
            if not self._settled:
                self._offset_s = min(self._offset_s, offset_s)
        if device_time_s >= self._until_s:
            if self._settled and self._least_s < STEP_S:
                self._rate = max(-MOST_DRIFT, min(MOST_DRIFT, _GAIN_HZ * self._least_s))
            self._until_s, self._least_s = device_time_s + SETTLED_S, STEP_S
            self._settled = True
        self._offset_s = max(self._offset_s, self._unix_s + _AFTER_S - device_time_s)
        self._device_time_s, self._unix_s = device_time_s, device_time_s + self._offset_s
        return self._unix_s


def capture_times(
    device_time_s: NDArray[Any], capture_s: NDArray[Any], host_time_s: NDArray[Any]
) -> NDArray[np.float64]:
    """Return when the first exposure of each recorded frame began; times as in `RawFrame`."""
    offset_s = host_time_s - capture_s - device_time_s
    times_s = np.empty(len(offset_s))
    begins = np.flatnonzero(np.diff(device_time_s) <= 0.0) + 1
    after_s = -np.inf
    for run in np.split(np.arange(len(offset_s)), begins):
        if len(run):
            near = offset_s[run][np.abs(offset_s[run] - offset_s[run[0]]) < STEP_S]
            set_s = max(near.min(), after_s - device_time_s[run[0]])
            times_s[run] = device_time_s[run] + set_s
            after_s = times_s[run[-1]] + _AFTER_S
    return times_s
