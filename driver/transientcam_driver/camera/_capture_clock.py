"""When frames were captured, in Unix time, whatever happens to the clock of the host.

The device's clock is set by the host's once: by the frame that came with the least delay. A step
of the host's clock moves nothing, and intervals are the device's, live within 0.2 %. Where the
device's clock begins anew it is set once more; times go on growing all the same.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

STEP_S: Final = 1.0
"""By how much the delay of frames may differ; more is a step of the host's clock."""
SETTLED_S: Final = 10.0
"""For so long from the first frame on, one that came sooner sets the clock at once."""
LATER: Final = 2e-4
SOONER: Final = 2e-3
"""How fast the clock then follows the host's, as both run apart, by seconds in a week."""
_AFTER_S: Final = 1e-5


class CaptureClock:
    """Times of a running capture; the first frames may still correct the clock."""

    def __init__(self) -> None:
        self._offset_s: float | None = None
        self._device_s = self._settled_s = 0.0
        self._unix_s = float("-inf")

    def unix_s(self, *, device_time_s: float, capture_s: float, host_time_s: float) -> float:
        """Return when the first exposure of the next frame began; times as in `RawFrame`."""
        offset_s, passed_s = host_time_s - capture_s - device_time_s, device_time_s - self._device_s
        if self._offset_s is None or passed_s <= 0.0:
            self._offset_s, self._settled_s = offset_s, device_time_s + SETTLED_S
        elif abs(late_s := offset_s - self._offset_s) < STEP_S:
            settled = device_time_s > self._settled_s
            least_s, most_s = (-SOONER * passed_s, LATER * passed_s) if settled else (late_s, 0.0)
            self._offset_s += max(least_s, min(most_s, late_s))
        self._offset_s = max(self._offset_s, self._unix_s + _AFTER_S - device_time_s)
        self._device_s, self._unix_s = device_time_s, device_time_s + self._offset_s
        return self._unix_s


_LATEST_S: Final = 1e15
"""What a file of others says beyond it is no time: that frame has one between its neighbours'."""


def capture_times(
    device_time_s: NDArray[Any], capture_s: NDArray[Any], host_time_s: NDArray[Any]
) -> NDArray[np.float64]:
    """Return when the first exposure of each recorded frame began; times as in `RawFrame`."""
    stated_s = np.stack([device_time_s, capture_s, host_time_s]).astype(np.float64)
    known = np.asarray((np.abs(stated_s) < _LATEST_S).all(axis=0))
    if not known.all():
        if not known.any():
            return np.zeros(len(known))
        others_s = capture_times(*stated_s[:, known])
        return np.interp(np.arange(len(known)), np.flatnonzero(known), others_s)
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
