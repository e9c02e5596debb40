"""The last seconds of raw captures, so that a frame can still be had after it has passed.

Everything here lives on the event loop; a frame costs it a few appends, whatever its size.
"""

import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging._frames.frame import Frame
from transientcam_server.settings import HistorySettings

_OPENED: Final = 2


@dataclass(frozen=True, slots=True)
class _StoredFrame:
    """A frame of which nothing is computed, and when it came."""

    frame: Frame
    arrived_s: float
    size_bytes: int


class History:
    """The newest frames, bounded in time and in the bytes of their raw images.

    What is computed of a former frame is kept for the last few of them that were requested; the
    captures alone are what is bounded here.

    ``latest``: the newest frame, also where its images alone are more than may be kept; None before
    the first.
    ``size_bytes``: of the raw images that are kept, never more than ``max_bytes``.
    """

    def __init__(
        self, settings: HistorySettings, *, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.settings = settings
        self.latest: Frame | None = None
        self.size_bytes = 0
        self._clock = clock
        self._kept: deque[_StoredFrame] = deque()
        self._opened: OrderedDict[int, Frame] = OrderedDict()

    @property
    def first(self) -> int | None:
        """Number of the oldest frame that can be had; None before there is any."""
        return self._kept[0].frame.number if self._kept else self.last

    @property
    def last(self) -> int | None:
        """Number of the newest frame."""
        return None if self.latest is None else self.latest.number

    @property
    def count(self) -> int:
        """How many frames can be had."""
        return 0 if self.first is None or self.last is None else self.last - self.first + 1

    @property
    def span_s(self) -> float:
        """From the arrival of the oldest frame to that of the newest."""
        return self._kept[-1].arrived_s - self._kept[0].arrived_s if self._kept else 0.0

    def append(self, frame: Frame) -> None:
        """Take the newest frame, and forget what there is no more room or time for."""
        self.latest = frame
        now_s, size_bytes = self._clock(), frame.size_bytes
        room_bytes = self.settings.max_bytes - size_bytes
        oldest_s = now_s - self.settings.seconds
        while self._kept and (self.size_bytes > room_bytes or self._kept[0].arrived_s < oldest_s):
            gone = self._kept.popleft()
            self.size_bytes -= gone.size_bytes
            self._opened.pop(gone.frame.number, None)
        if room_bytes >= 0:
            self._kept.append(_StoredFrame(frame.bare(), now_s, size_bytes))
            self.size_bytes += size_bytes

    def frame(self, number: int) -> Frame:
        """Return a frame by its number.

        Raises Problem ``frame-gone`` for one that was, ``unknown-frame`` for one that was not yet;
        both say which there are.
        """
        if self.latest is not None and number == self.latest.number:
            return self.latest
        first, last = self.first, self.last
        if first is None or last is None or not first <= number <= last:
            raise self._missing(number)
        found = self._opened.get(number)
        if found is None:
            found = self._opened[number] = self._kept[number - first].frame.bare()
        self._opened.move_to_end(number)
        while len(self._opened) > _OPENED:
            self._opened.popitem(last=False)
        return found

    def newest(self, duration_s: float) -> list[Frame]:
        """Return the frames of the last seconds, oldest first, of one sequence: the newest's.

        Those before the sequence was last changed are left out.
        """
        found: list[Frame] = []
        for kept in reversed(self._kept):
            applied = kept.frame.recipe.applied
            if found and applied != found[-1].recipe.applied:
                break
            if kept.arrived_s < self._kept[-1].arrived_s - duration_s:
                break
            found.append(kept.frame)
        return found[::-1]

    def _missing(self, number: int) -> Problem:
        first, last = self.first, self.last
        if last is None:
            there = "There are no frames yet."
        else:
            there = f"There are frames {first} to {last}."
        if last is not None and 0 < number <= last:
            kind, what = kinds.FRAME_GONE, f"Frame {number} is not kept any more."
        else:
            kind, what = kinds.UNKNOWN_FRAME, f"There is no frame {number}."
        limit = None if last is None else f"from {first} to {last}"
        return Problem(
            kind,
            f"{what} {there}",
            field="frame",
            value=number,
            limit=limit,
            first=first,
            last=last,
        )
