"""The newest frame for every subscriber: a slow one loses frames, none waits for another.

Everything here lives on the event loop and never waits for a client.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from transientcam import wire
from transientcam_server.broadcast._channel import Channel, ChannelNumbers
from transientcam_server.broadcast._outbox import Close, Outbox
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import Frame


class Hub:
    """Hands frames and notices of the service to the outboxes of its clients.

    ``latest``: the newest frame, None before the first.
    ``reads``: how often a single frame was asked for.
    ``dropped``: frames that clients were too slow for, of all clients together.
    ``deserted``: set while there are no clients.
    ``obstacle``: says why no frames come and what helps; empty where that is not known.
    """

    def __init__(self) -> None:
        self.latest: Frame | None = None
        self.reads = 0
        self.dropped = 0
        self._outboxes: set[Outbox] = set()
        self._arrived = asyncio.Event()
        self.obstacle: Callable[[], str] = lambda: ""
        self._closed = False
        self._numbers = ChannelNumbers()
        self.deserted = asyncio.Event()
        self.deserted.set()

    @property
    def clients(self) -> int:
        """How many clients there are."""
        return len(self._outboxes)

    @property
    def outboxes(self) -> tuple[Outbox, ...]:
        """Of all clients, also those that have not subscribed yet."""
        return tuple(self._outboxes)

    def join(self, outbox: Outbox) -> None:
        """Add an outbox, from the next frame on."""
        self._outboxes.add(outbox)
        self.deserted.clear()
        if self._closed:
            outbox.put(_SHUTDOWN)

    def leave(self, outbox: Outbox) -> None:
        """Remove an outbox."""
        self._outboxes.discard(outbox)
        self._numbers.release(outbox.channels)
        if not self._outboxes:
            self.deserted.set()

    def subscribe(self, outbox: Outbox, channels: Iterable[Channel], *, credit: int | None) -> None:
        """Subscribe an outbox to channels, and number them: equal ones alike."""
        former, chosen = outbox.channels, tuple(channels)
        self._numbers.assign(chosen)
        self._numbers.release(former)
        outbox.subscribe(chosen, credit=credit)

    def publish(self, frame: Frame) -> None:
        """Put the newest frame into the outboxes of all subscribers."""
        self.latest = frame
        arrived, self._arrived = self._arrived, asyncio.Event()
        arrived.set()
        for outbox in self._outboxes:
            self.dropped += outbox.put_frame(frame)
        if frame.raw.lost_images:
            self.notify("lost-images", {"count": frame.raw.lost_images, "frame": frame.number})

    def notify(self, kind: str, details: Mapping[str, Any]) -> None:
        """Send a notice to every subscriber."""
        for outbox in self.subscribers:
            outbox.put(wire.Notice(kind, details))

    @property
    def subscribers(self) -> tuple[Outbox, ...]:
        """Outboxes of the clients that have subscribed."""
        return tuple(outbox for outbox in self._outboxes if outbox.channels)

    def partly_sent(self, number: int) -> Frame | None:
        """Return a frame that some client has a region of and may request more of; None if none.

        What was computed of it is not computed anew then.
        """
        self.reads += 1
        found = (outbox.partly_sent(number) for outbox in self._outboxes)
        return next((frame for frame in found if frame is not None), None)

    async def newest(self, *, after: int, wait_s: float) -> Frame:
        """Return the newest frame once its number is greater than ``after``.

        Raises Problem ``no-frame-yet`` if none came within ``wait_s``, ``shutting-down``.
        """
        self.reads += 1
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                while not self._closed:
                    if self.latest is not None and self.latest.number > after:
                        return self.latest
                    await self._arrived.wait()
        if self._closed:
            raise Problem(kinds.SHUTTING_DOWN, "The service shuts down.")
        what = f"No frame after frame {after}" if after else "No frame"
        why = f": {obstacle}." if (obstacle := self.obstacle()) else "."
        raise Problem(
            kinds.NO_FRAME_YET, f"{what} was captured within {wait_s:g} s of waiting{why}"
        )

    def close(self) -> None:
        """Close all streams, and those that join later."""
        self._closed = True
        self._arrived.set()
        for outbox in self._outboxes:
            outbox.put(_SHUTDOWN)


_SHUTDOWN = Close(wire.CloseCode.GOING_AWAY, "the service shuts down")
