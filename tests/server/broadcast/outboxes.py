"""What a stream's client would get: outboxes with one channel, and what waits in them."""

import asyncio
from collections.abc import Callable

from tests.server.fakes import channel
from transientcam_server.broadcast import Delivery, Item, Outbox


def run(test: Callable[[], object]) -> None:
    async def main() -> None:
        result = test()
        if asyncio.iscoroutine(result):
            await result

    asyncio.run(main())


def waiting(outbox: Outbox) -> list[Item]:
    """Take everything an outbox would hand out now."""
    items = []
    while (item := outbox._take()) is not None:
        items.append(item)
    return items


def numbers(items: list[Item]) -> list[int]:
    return [item.frame.number for item in items if isinstance(item, Delivery)]


def lost(items: list[Item]) -> tuple[int, int]:
    """Return how many frames the deliveries say were dropped, and how many unacknowledged."""
    said = [each for item in items if isinstance(item, Delivery) for each in item.lost]
    return sum(each.count for each in said), sum(each.unacknowledged for each in said)


def subscribed(
    *, depth: int = 2, credit: int | None = None, rate_hz: float | None = None
) -> Outbox:
    outbox = Outbox(depth=depth)
    outbox.subscribe((channel(max_rate_hz=rate_hz),), credit=credit)
    return outbox
