"""The newest frame to everybody who looks: a slow one loses frames, nobody waits for anybody.

Everything here lives on the event loop and never waits for a client.
"""

import asyncio
import contextlib
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from transientcam import wire
from transientcam_server import problem_kinds as kinds
from transientcam_server.auth import ANYBODY
from transientcam_server.errors import Problem
from transientcam_server.pipeline import Frame
from transientcam_server.products import Product

MAX_WAITING_MESSAGES: Final = 64
"""A client that lets more than this many notices and answers wait is not there any more."""
_EARLY_PERIODS = 0.1


@dataclass(frozen=True, slots=True)
class Goodbye:
    """The last thing a client is told."""

    code: wire.CloseCode
    reason: str


@dataclass(slots=True)
class Channel:
    """One product for one client: how often it is wanted, and what of it was lost."""

    number: int
    product: Product
    max_rate_hz: float | None
    next_due_s: float = float("-inf")
    dropped: int = 0
    dropped_total: int = 0

    def take(self, time_s: float) -> bool:
        """Return whether the frame captured at ``time_s`` is due, and count on from there."""
        if self.max_rate_hz is None:
            return True
        period_s = 1.0 / self.max_rate_hz
        # a little early will do: frames come with jitter, also at the very rate asked for
        if time_s < self.next_due_s - _EARLY_PERIODS * period_s:
            return False
        # by schedule, so that the mean rate is the one asked for; anew after a pause
        late = time_s - self.next_due_s > period_s
        self.next_due_s = (time_s if late else self.next_due_s) + period_s
        return True


@dataclass(frozen=True, slots=True)
class Delivery:
    """A frame on its way to one client, for the channels it was due for."""

    frame: Frame
    channels: tuple[Channel, ...]


Item = Delivery | wire.Hello | wire.Notice | wire.ErrorMessage | Goodbye


class Outbox:
    """What waits for one client, in order: few frames, the newest; and all messages.

    With ``credits`` only that many frames may be on their way unacknowledged, and what waits is
    the newest frame alone.

    Attributes
    ----------
    owner
        Whom the client has shown to be.
    """

    def __init__(self, *, depth: int) -> None:
        self.owner = ANYBODY
        self._depth = depth
        self._channels: tuple[Channel, ...] = ()
        self._credits: int | None = None
        self._unacknowledged: deque[int] = deque()
        self._waiting: deque[Item] = deque()
        self._changed = asyncio.Event()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What the client is subscribed to."""
        return self._channels

    def subscribe(self, channels: tuple[Channel, ...], *, credit: int | None) -> None:
        """Replace the subscription; frames of the former that still wait are forgotten."""
        self._channels = channels
        self._credits = credit
        self._unacknowledged.clear()
        self._waiting = deque(item for item in self._waiting if not isinstance(item, Delivery))

    def acknowledge(self, number: int) -> None:
        """Note that the client is done with this frame and all before it."""
        while self._unacknowledged and self._unacknowledged[0] <= number:
            self._unacknowledged.popleft()
        self._changed.set()

    def put_frame(self, frame: Frame) -> int:
        """Let a frame wait; where too many do, drop the oldest and return how many."""
        due = tuple(c for c in self._channels if c.take(frame.raw.device_time_s))
        if not due:
            return 0
        waiting = [item for item in self._waiting if isinstance(item, Delivery)]
        depth = self._depth if self._credits is None else 1
        dropped = waiting[: max(0, len(waiting) + 1 - depth)]
        for oldest in dropped:
            self._waiting.remove(oldest)
            for channel in oldest.channels:
                channel.dropped += 1
        self._waiting.append(Delivery(frame, due))
        self._changed.set()
        return len(dropped)

    def put(self, item: wire.Hello | wire.Notice | wire.ErrorMessage | Goodbye) -> None:
        """Let a message wait; a client with too many of them is told goodbye instead."""
        if len(self._waiting) >= MAX_WAITING_MESSAGES:
            self._waiting.clear()
            item = Goodbye(wire.CloseCode.TRY_AGAIN_LATER, "too many messages waited")
        self._waiting.append(item)
        self._changed.set()

    async def next(self) -> Item:
        """Return what is to be sent next, as soon as there is something that may be."""
        while (item := self._take()) is None:
            self._changed.clear()
            await self._changed.wait()
        return item

    def _take(self) -> Item | None:
        for item in self._waiting:
            if not isinstance(item, Delivery):
                self._waiting.remove(item)
                return item
            if self._credits is None or len(self._unacknowledged) < self._credits:
                self._waiting.remove(item)
                if self._credits is not None:
                    self._unacknowledged.append(item.frame.number)
                return item
        return None


class Hub:
    """Where the acquisition's frames and news meet those who want them.

    Attributes
    ----------
    latest
        The newest frame, None before the first.
    dropped
        Frames that clients were too slow for, of all clients together.
    deserted
        Set while nobody looks on.
    """

    def __init__(self) -> None:
        self.latest: Frame | None = None
        self.dropped = 0
        self._outboxes: set[Outbox] = set()
        self._arrived = asyncio.Event()
        self._closed = False
        self._channel_numbers: dict[str, int] = {}
        self.deserted = asyncio.Event()
        self.deserted.set()

    @property
    def clients(self) -> int:
        """How many look on."""
        return len(self._outboxes)

    @property
    def outboxes(self) -> tuple[Outbox, ...]:
        """Of everybody, also those who have not said yet what to send."""
        return tuple(self._outboxes)

    def join(self, outbox: Outbox) -> None:
        """Let an outbox take part from the next frame on."""
        self._outboxes.add(outbox)
        self.deserted.clear()
        if self._closed:
            outbox.put(_SHUTDOWN)

    def leave(self, outbox: Outbox) -> None:
        """Forget an outbox."""
        self._outboxes.discard(outbox)
        if not self._outboxes:
            self.deserted.set()

    def channel_number(self, product: Product) -> int:
        """Return the number of a product's channel: the same for all, so its bytes are too."""
        return self._channel_numbers.setdefault(product.name, len(self._channel_numbers))

    def publish(self, frame: Frame) -> None:
        """Hand the newest frame to everybody."""
        self.latest = frame
        arrived, self._arrived = self._arrived, asyncio.Event()
        arrived.set()
        for outbox in self._outboxes:
            self.dropped += outbox.put_frame(frame)
        if frame.raw.lost_images:
            self.tell("lost-images", {"count": frame.raw.lost_images, "frame": frame.number})

    def tell(self, kind: str, details: Mapping[str, Any]) -> None:
        """Tell everybody some news."""
        for outbox in self.subscribers:
            outbox.put(wire.Notice(kind, details))

    @property
    def subscribers(self) -> tuple[Outbox, ...]:
        """Everybody who has said what to send."""
        return tuple(outbox for outbox in self._outboxes if outbox.channels)

    async def newest(self, *, after: int, wait_s: float) -> Frame:
        """Return the newest frame once its number is greater than ``after``.

        Raises
        ------
        Problem
            ``no-frame-yet`` if none came within ``wait_s``, ``shutting-down``.
        """
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                while not self._closed:
                    if self.latest is not None and self.latest.number > after:
                        return self.latest
                    await self._arrived.wait()
        if self._closed:
            raise Problem(kinds.SHUTTING_DOWN, "The service shuts down.")
        what = f"No frame after frame {after}" if after else "No frame"
        raise Problem(kinds.NO_FRAME_YET, f"{what} was captured within {wait_s:g} s of waiting.")

    def close(self) -> None:
        """Send everybody away."""
        self._closed = True
        self._arrived.set()
        for outbox in self._outboxes:
            outbox.put(_SHUTDOWN)


_SHUTDOWN = Goodbye(wire.CloseCode.GOING_AWAY, "the service shuts down")
