"""Which topics viewers look at, known to the thread that sends them."""

import threading
from collections import Counter

from foxglove.websocket import ChannelView, Client, ServerListener


class Watching(ServerListener):
    """Counts the viewers of each topic; the server calls it from threads of its own."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._viewers: Counter[str] = Counter()
        self._closed = False

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Count a viewer of a topic."""
        with self._changed:
            self._viewers[channel.topic] += 1
            self._changed.notify_all()

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """Discount a viewer, also one whose connection broke."""
        with self._changed:
            self._viewers[channel.topic] -= 1
            self._changed.notify_all()

    @property
    def topics(self) -> frozenset[str]:
        """Those that somebody looks at; none once it is closed."""
        with self._changed:
            return self._topics()

    @property
    def closed(self) -> bool:
        """Whether it was closed."""
        return self._closed

    def other_than(self, topics: frozenset[str]) -> frozenset[str]:
        """Wait until others than these are looked at, or it is closed, and return them."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._topics() != topics)
            return self._topics()

    def pause(self, duration_s: float) -> None:
        """Wait so long, or until it is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed, duration_s)

    def close(self) -> None:
        """End every wait."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _topics(self) -> frozenset[str]:
        return frozenset() if self._closed else frozenset(+self._viewers)
