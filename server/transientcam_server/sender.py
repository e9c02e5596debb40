"""The sending half of a stream: an outbox into a WebSocket."""

import asyncio
import time
from typing import Any

from fastapi import WebSocket

from transientcam import wire
from transientcam_server.allowance import Allowance
from transientcam_server.errors import Problem
from transientcam_server.metrics import Metrics
from transientcam_server.outbox import Channel, Delivery, Goodbye, Outbox
from transientcam_server.problems import problem_document
from transientcam_server.products import View


class Sender:
    """Empties an outbox into a WebSocket."""

    def __init__(
        self, websocket: WebSocket, outbox: Outbox, metrics: Metrics, allowance: Allowance
    ) -> None:
        self._websocket = websocket
        self._allowance = allowance
        self._metrics = metrics
        self._outbox = outbox
        self._failing: set[str] = set()

    async def send_all(self) -> None:
        """Send until the client is gone or was told goodbye."""
        while True:
            item = await self._outbox.next()
            if isinstance(item, Goodbye):
                await self._websocket.close(item.code, item.reason)
                return
            if isinstance(item, Delivery):
                await self._deliver(item)
            else:
                await self._websocket.send_bytes(wire.encode(item))

    async def _deliver(self, delivery: Delivery) -> None:
        # all products of the frame are under way at once; each is sent as soon as those before
        work = [self._encoded(delivery, channel) for channel in delivery.channels]
        tasks = [asyncio.ensure_future(each) for each in work]
        try:
            for channel, task in zip(delivery.channels, tasks, strict=True):
                await self._tell_dropped(channel)
                try:
                    data = await task
                except Problem as problem:
                    await self._tell_failed(channel, problem)
                else:
                    self._failing.discard(channel.product.name)
                    self._allowance.earn()  # for its acknowledgement
                    await self._websocket.send_bytes(data)
                    self._metrics.sent(time.time() - delivery.frame.raw.host_time_s)
        finally:
            for task in tasks:
                task.cancel()

    async def _encoded(self, delivery: Delivery, channel: Channel) -> bytes:
        return await delivery.frame.encoded(
            channel.product, channel.encoding, View(crop=channel.crop), channel=channel.number
        )

    async def _tell_dropped(self, channel: Channel) -> None:
        if channel.dropped:
            count, channel.dropped = channel.dropped, 0
            channel.dropped_total += count
            details = {"channel": channel.number, "count": count, "total": channel.dropped_total}
            await self._websocket.send_bytes(wire.encode(wire.Notice("dropped", details)))

    async def _tell_failed(self, channel: Channel, problem: Problem) -> None:
        """Tell a failure once, not with every frame until it is mended."""
        if channel.product.name not in self._failing:
            self._failing.add(channel.product.name)
            document: dict[str, Any] = problem_document(problem)
            document["channel"] = channel.number
            await self._websocket.send_bytes(wire.encode(wire.ErrorMessage(document)))
