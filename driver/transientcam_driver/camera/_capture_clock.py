"""When frames were captured, in Unix time, whatever happens to the clock of the host."""


class CaptureClock:
    """Times of captures: the device's clock, set by the host's clock at the first frame.

    A step of the host's clock moves none of them, and their intervals are the device's. Where the
    device's clock begins anew it is set once more; times go on growing all the same.
    """

    def __init__(self) -> None:
        self._offset_s: float | None = None
        self._device_time_s = self._unix_s = 0.0

    def unix_s(self, *, device_time_s: float, capture_s: float, host_time_s: float) -> float:
        """Return when the first exposure of the next frame began; times as in `RawFrame`."""
        begun_s = host_time_s - capture_s
        if self._offset_s is None:
            self._offset_s = begun_s - device_time_s
        elif device_time_s <= self._device_time_s:
            self._offset_s = max(begun_s, self._unix_s + 1e-3) - device_time_s
        self._device_time_s, self._unix_s = device_time_s, device_time_s + self._offset_s
        return self._unix_s
