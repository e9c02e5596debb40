"""Rates, latencies and losses of a stream, from its frames and notices."""

from collections import deque
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from transientcam.frame import Frame
from transientcam.wire import Notice

_WINDOW_S: Final = 3.0


@dataclass(frozen=True, slots=True)
class Sample:
    """The statistics at one frame."""

    frame: int
    product: str
    unit: str
    rate_hz: float | None
    """Frames a second over the last seconds; None until there are two."""
    latency_s: float
    """From the arrival of the last image at the daemon to here, if both clocks agree."""
    median: float | None
    """Over the pixels that have a value; None where there are none, or the product has more than
    one value a pixel."""
    dropped: int
    lost_images: int

    def to_document(self) -> dict[str, Any]:
        """Return what ``--json`` prints."""
        return {"type": "frame", **{name: getattr(self, name) for name in self.__slots__}}


class Statistics:
    """Counts and rates of one stream."""

    def __init__(self) -> None:
        self.dropped = 0
        self.lost_images = 0
        self._newest: int | None = None
        self._arrivals_s: deque[float] = deque()

    def frame(self, frame: Frame, *, now_s: float) -> Sample:
        """Count a frame that was received at ``now_s``, Unix time."""
        if frame.frame != self._newest:
            self._newest = frame.frame
            self._arrivals_s.append(now_s)
            while now_s - self._arrivals_s[0] > _WINDOW_S:
                self._arrivals_s.popleft()
        return Sample(
            frame=frame.frame,
            product=frame.product,
            unit=frame.unit,
            rate_hz=self._rate_hz(),
            latency_s=now_s - float(frame.meta["host_time_s"]),
            median=_median(frame),
            dropped=self.dropped,
            lost_images=self.lost_images,
        )

    def notice(self, notice: Notice) -> None:
        """Count the losses that a notice reports."""
        count = notice.details.get("count")
        if isinstance(count, int):
            if notice.kind == "dropped":
                self.dropped += count
            elif notice.kind == "lost-images":
                self.lost_images += count

    def _rate_hz(self) -> float | None:
        if len(self._arrivals_s) < 2:
            return None
        duration_s = self._arrivals_s[-1] - self._arrivals_s[0]
        return (len(self._arrivals_s) - 1) / duration_s if duration_s > 0.0 else None


def _median(frame: Frame) -> float | None:
    if frame.axes != ("y", "x"):
        return None
    finite = frame.array[np.isfinite(frame.array)]
    return float(np.median(finite)) if finite.size else None
