"""What waits for one client of the stream: few frames, the newest; and all messages.

Everything here lives on the event loop and never waits for a client.
"""

import asyncio
from collections import deque
from collections.abc import Coroutine
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

from transientcam import wire
from transientcam_server.broadcast._channel import Channel, DroppedFrames
from transientcam_server.imaging import Frame

MAX_WAITING_MESSAGES: Final = 64
"""A client that lets more than this many notices and answers wait is not there any more."""
_PARTLY_SENT: Final = 2
"""Unacknowledged frames that a client got a part of, and may request more of."""


class Past(Protocol):
    """Frames that have passed: what a client resumes from."""

    @property
    def first(self) -> int | None:
        """Number of the oldest frame that can be had."""
        ...

    @property
    def last(self) -> int | None:
        """Number of the newest frame; None before there is any."""
        ...

    def frame(self, number: int) -> Frame:
        """Return a frame from the first to the last."""
        ...


@dataclass(frozen=True, slots=True)
class Close:
    """The end of a stream: its code and reason."""

    code: wire.CloseCode
    reason: str


@dataclass(frozen=True, slots=True)
class Delivery:
    """A frame on its way to one client, for the channels it was due for.

    ``lost`` has for each of them what was dropped before this frame was taken to be sent.
    """

    frame: Frame
    channels: tuple[Channel, ...]
    lost: tuple[DroppedFrames, ...] = ()

    def computed(self) -> Coroutine[Any, Any, None]:
        """Return what waits until all is computed that its products follow from, or has failed."""
        return self.frame.computed([channel.product for channel in self.channels])


Message = wire.Hello | wire.Notice | wire.ErrorMessage | Close
Item = Delivery | Message


class Outbox:
    """What waits for one client, in order.

    With ``credits`` only so many frames may be on their way unacknowledged, and what waits is the
    newest frame alone. A client that resumes gets every frame that the past still has, in order
    and as fast as it takes them, and with the newest it is one like all others.

    ``owner``: as whom the client has authenticated; None before it has.
    """

    def __init__(self, *, depth: int) -> None:
        self.owner: object | None = None
        self._depth = depth
        self._channels: tuple[Channel, ...] = ()
        self._credits: int | None = None
        self._unacknowledged: deque[int] = deque()
        self._partly_sent: deque[Frame] = deque(maxlen=_PARTLY_SENT)
        self._waiting: deque[Item] = deque()
        self._resuming: tuple[Past, int] | None = None
        self._changed = asyncio.Event()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What the client is subscribed to."""
        return self._channels

    def subscribe(self, channels: tuple[Channel, ...], *, credit: int | None) -> None:
        """Replace the subscription; frames of the former that still wait are forgotten."""
        self._channels = channels
        self._credits = credit
        self._resuming = None
        self._unacknowledged.clear()
        if credit is None:  # nothing is acknowledged; else requests may still be on their way
            self._partly_sent.clear()
        self._waiting = deque(item for item in self._waiting if not isinstance(item, Delivery))

    def resume(self, past: Past, *, start: int) -> None:
        """Begin with frame ``start`` instead of the next one; a notice lists what is missing."""
        following = (past.last or 0) + 1
        if start > following:  # it may never come: the client is not kept waiting
            self.put(_gap(following, start - 1, "not captured yet"))
        elif start < following:
            self._resuming = past, start
            self._changed.set()

    def acknowledge(self, number: int) -> None:
        """Note that the client is done with this frame and all before it."""
        while self._unacknowledged and self._unacknowledged[0] <= number:
            self._unacknowledged.popleft()
        while self._partly_sent and self._partly_sent[0].number <= number:
            self._partly_sent.popleft()
        self._changed.set()

    def partly_sent(self, number: int) -> Frame | None:
        """Return a frame that the client has a region of and did not acknowledge; None if none."""
        return next((frame for frame in self._partly_sent if frame.number == number), None)

    def put_frame(self, frame: Frame) -> int:
        """Let a frame wait; where too many do, drop the oldest and return how many."""
        if self._resuming is not None:  # it is in the past already, and has its turn there
            self._changed.set()
            return 0
        due = self._due(frame)
        if not due:
            return 0
        waiting = [item for item in self._waiting if isinstance(item, Delivery)]
        depth = self._depth if self._credits is None else 1
        dropped = waiting[: max(0, len(waiting) + 1 - depth)]
        for oldest in dropped:
            self._waiting.remove(oldest)
            for channel in oldest.channels:
                channel.dropped += 1
                channel.dropped_unacknowledged += not self._has_credit
        self._waiting.append(Delivery(frame, due))
        self._changed.set()
        return len(dropped)

    def put(self, item: Message) -> None:
        """Let a message wait; a stream with too many of them is closed instead."""
        if len(self._waiting) >= MAX_WAITING_MESSAGES:
            self._waiting.clear()
            item = Close(wire.CloseCode.TRY_AGAIN_LATER, "too many messages waited")
        self._waiting.append(item)
        self._changed.set()

    async def next(self) -> Item:
        """Return what is to be sent next, as soon as there is something that may be."""
        while (item := self._take()) is None:
            self._changed.clear()
            await self._changed.wait()
        return item

    @property
    def _has_credit(self) -> bool:
        return self._credits is None or len(self._unacknowledged) < self._credits

    def _take(self) -> Item | None:
        may_send = self._has_credit
        for item in self._waiting:
            if not isinstance(item, Delivery):
                self._waiting.remove(item)
                return item
            if may_send:
                self._waiting.remove(item)
                return self._under_way(item)
        return self._take_from_past() if may_send else None

    def _take_from_past(self) -> Item | None:
        while self._resuming is not None:
            past, number = self._resuming
            if past.first is None or past.last is None or number > past.last:
                self._resuming = None  # with the others from here on
            elif number < past.first:
                self._resuming = past, past.first
                return _gap(number, past.first - 1, "not kept any more")
            else:
                self._resuming = past, number + 1
                frame = past.frame(number)
                if due := self._due(frame):
                    return self._under_way(Delivery(frame, due))
        return None

    def _under_way(self, delivery: Delivery) -> Delivery:
        if self._credits is not None:
            self._unacknowledged.append(delivery.frame.number)
            if any(channel.crop.region is not None for channel in delivery.channels):
                self._partly_sent.append(delivery.frame)
        return replace(delivery, lost=tuple(channel.take_lost() for channel in delivery.channels))

    def _due(self, frame: Frame) -> tuple[Channel, ...]:
        return tuple(c for c in self._channels if c.take(frame.raw.device_time_s))


def _gap(first: int, last: int, reason: str) -> wire.Notice:
    details: dict[str, Any] = {"from": first, "to": last, "reason": reason}
    return wire.Notice("gap", details)
