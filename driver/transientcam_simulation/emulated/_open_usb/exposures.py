"""Exposures and the FIFO behind them, as a function of time alone (usb-protocol 8.3, 8.4)."""

from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Exposed:
    """An image by its place in time; its pixels are rendered when it is read.

    ``due_s`` is when its read-out is over; ``after_overflow`` is true where images in front of it
    were dropped.
    """

    number: int
    frame: int
    index: int
    begin_s: float
    due_s: float
    after_overflow: bool


@dataclass(slots=True)
class _Run:
    """Images exposed back to back since ``start_s``."""

    start_s: float
    period_s: float
    count: int
    first_image: int
    first_frame: int
    exposed: int = 0

    def image(self, k: int, *, after_overflow: bool) -> Exposed:
        """Return the k-th image of the run."""
        return Exposed(
            number=self.first_image + k,
            frame=self.first_frame + k // self.count,
            index=k % self.count,
            begin_s=self.start_s + k * self.period_s,
            due_s=self.start_s + (k + 1) * self.period_s,
            after_overflow=after_overflow,
        )


class Exposures:
    """The shutter and the FIFO behind it.

    Image k of a run is exposed from ``start + k T`` and stands in the FIFO from
    ``start + (k + 1) T`` (usb-protocol 8.4). An image without room is lost with the rest of its
    frame; storing goes on with a frame that has room (8.3), so that a host that is always too
    slow gets whole frames.

    ``room``: images the FIFO holds.
    """

    def __init__(self, room: int) -> None:
        self.next_image = 0
        self.next_frame = 0
        self.dropped = 0
        self.high_water = 0
        self._room = room
        self._run: _Run | None = None
        self._fifo: deque[Exposed] = deque()
        self._overflowed = False

    def __len__(self) -> int:
        """Images in the FIFO."""
        return len(self._fifo)

    @property
    def running(self) -> bool:
        """Whether images are being exposed."""
        return self._run is not None

    def begin(self, now_s: float, *, period_s: float, count: int) -> None:
        """Expose frames of ``count`` images from now on."""
        self._run = _Run(now_s, period_s, count, self.next_image, self.next_frame)

    def end(self) -> None:
        """Stop; what is exposed already stays in the FIFO."""
        if self._run is not None and self._run.exposed % self._run.count:
            self.next_frame += 1  # the frame that was abandoned keeps its number
        self._run = None

    def flush(self) -> None:
        """Empty the FIFO."""
        self._fifo.clear()
        self._overflowed = False

    def advance(self, now_s: float) -> None:
        """Advance to now: store the images exposed since the last call."""
        run = self._run
        if run is None:
            return
        # half a nanosecond, so that a wait until the due time finds the image there
        exposed = max(run.exposed, int((now_s + 0.5e-9 - run.start_s) / run.period_s))
        for k in range(run.exposed, exposed):
            self._store(run, k)
        run.exposed = exposed
        self.high_water = max(self.high_water, len(self._fifo))
        self.next_image = run.first_image + exposed
        self.next_frame = run.first_frame + exposed // run.count

    def upcoming(self) -> Exposed | None:
        """Return the image that is read next, in the FIFO already or still to come."""
        if self._fifo:
            return self._fifo[0]
        run = self._run
        if run is None:
            return None
        k = run.exposed
        if self._overflowed:  # usb-protocol 8.3: storing goes on with the first image of a frame
            k = -(-k // run.count) * run.count
        return run.image(k, after_overflow=self._overflowed)

    def take(self) -> Exposed | None:
        """Take the oldest image out of the FIFO."""
        return self._fifo.popleft() if self._fifo else None

    def _store(self, run: _Run, k: int) -> None:
        # usb-protocol 8.3: room for a frame, or half the FIFO where frames are larger
        free = self._room - len(self._fifo)
        resumes = k % run.count == 0 and free >= min(run.count, self._room // 2)
        if free == 0 or (self._overflowed and not resumes):
            self._overflowed = True
            self.dropped += 1
            return
        self._fifo.append(run.image(k, after_overflow=self._overflowed))
        self._overflowed = False
