"""The sending half of a stream: an outbox into a WebSocket."""

import asyncio
import time
from collections import deque
from typing import Any

from fastapi import WebSocket

from transientcam import wire
from transientcam_server.api._metrics import Metrics
from transientcam_server.broadcast import Channel, Close, Delivery, DroppedFrames, Item, Outbox
from transientcam_server.errors import Problem, problem_document
from transientcam_server.imaging import View

_AT_ONCE = 4
"""Deliveries after which other tasks run."""
_COMPUTED_AT_ONCE = 2
"""Frames that are computed at once for one client, each on a core; one alone takes all cores."""
_SHORT_S = 0.1
"""Longer ones are computed one after another: requests of other clients would wait for both."""


class Sender:
    """Empties an outbox into a WebSocket.

    To a client that keeps up, frames are taken and computed while others are encoded and sent, so
    that all cores are at work: two short ones at once, and as many wait to be sent at most. A
    client that is slow to receive gets what is newest when it has.
    """

    def __init__(self, websocket: WebSocket, outbox: Outbox, metrics: Metrics) -> None:
        self._websocket = websocket
        self._metrics = metrics
        self._outbox = outbox
        self._failing: set[str] = set()
        self._keeps_up, self._sending_s = True, 0.0
        self._at_once = _COMPUTED_AT_ONCE
        self._computing: set[asyncio.Future[None]] = set()

    async def send_all(self) -> None:
        """Send until the client is gone or the stream was closed."""
        delivered = 0
        ahead: deque[asyncio.Task[Item]] = deque()
        try:
            while True:
                item = await (ahead.popleft() if ahead else self._take())
                if isinstance(item, Close):
                    await self._websocket.close(item.code, item.reason)
                    return
                if isinstance(item, Delivery):
                    while self._keeps_up and len(ahead) < self._at_once:
                        ahead.append(asyncio.ensure_future(self._take(*list(ahead)[-1:])))
                    await self._deliver(item)
                    delivered += 1
                    if delivered % _AT_ONCE == 0:
                        # nothing above has to wait where all is computed and the network takes it
                        await asyncio.sleep(0)
                else:
                    await self._websocket.send_bytes(wire.encode(item))
        finally:
            for task in ahead:
                task.cancel()
            await asyncio.gather(*ahead, return_exceptions=True)

    async def _take(self, *before: asyncio.Task[Item]) -> Item:
        """Return what is to be sent after another, and begin to compute it where few enough are."""
        await asyncio.gather(*before)
        while len(self._computing) >= self._at_once:
            await asyncio.wait(self._computing, return_when=asyncio.FIRST_COMPLETED)
        item = await self._outbox.next()
        if isinstance(item, Delivery):
            computing = asyncio.ensure_future(item.computed())
            self._computing.add(computing)
            computing.add_done_callback(self._computing.discard)
        return item

    async def _deliver(self, delivery: Delivery) -> None:
        _, *others = delivery.channels
        self._sending_s = 0.0
        # all products of the frame are under way at once; each is sent as soon as those before
        tasks = [asyncio.ensure_future(self._encoded(delivery, each)) for each in others]
        try:
            for channel, lost, task in zip(
                delivery.channels, delivery.lost, (None, *tasks), strict=True
            ):
                if lost.count:
                    await self._report_dropped(channel, lost)
                await self._send(delivery, channel, task)
        finally:
            for task in tasks:
                task.cancel()
        reconstruct_s = delivery.frame.reconstruct_s
        self._keeps_up = self._sending_s <= reconstruct_s
        self._at_once = _COMPUTED_AT_ONCE if reconstruct_s <= _SHORT_S else 1

    async def _send(
        self, delivery: Delivery, channel: Channel, task: asyncio.Task[bytes] | None
    ) -> None:
        try:
            data = await (self._encoded(delivery, channel) if task is None else task)
        except Problem as problem:
            await self._report_failed(channel, problem)
            return
        self._failing.discard(channel.product.name)
        begin_s = time.perf_counter()
        await self._websocket.send_bytes(data)
        self._sending_s += time.perf_counter() - begin_s
        self._metrics.sent(time.time() - delivery.frame.raw.host_time_s)

    async def _encoded(self, delivery: Delivery, channel: Channel) -> bytes:
        return await delivery.frame.encoded(
            channel.product, channel.encoding, View(crop=channel.crop), channel=channel.number
        )

    async def _report_dropped(self, channel: Channel, lost: DroppedFrames) -> None:
        channel.dropped_total += lost.count
        details = {
            "channel": channel.number,
            "count": lost.count,
            "total": channel.dropped_total,
            "unacknowledged": lost.unacknowledged,
        }
        await self._websocket.send_bytes(wire.encode(wire.Notice("dropped", details)))

    async def _report_failed(self, channel: Channel, problem: Problem) -> None:
        """Report a failure once, not with every frame until it is fixed."""
        if channel.product.name not in self._failing:
            self._failing.add(channel.product.name)
            document: dict[str, Any] = problem_document(problem)
            document["channel"] = channel.number
            await self._websocket.send_bytes(wire.encode(wire.ErrorMessage(document)))
