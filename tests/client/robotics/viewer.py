"""A viewer of Foxglove's WebSocket protocol that is nobody's library but the decoder of messages.

Its words are those of the protocol's specification: text frames are JSON with ``op``; a binary
frame is 1, the subscription (u32), the time in ns (u64), all little-endian, and the message.
"""

import base64
import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

_MESSAGE = struct.Struct("<BIQ")
_WAIT_S = 120.0
"""For an event that comes, on a machine that is laden; not a measurement."""


@dataclass(frozen=True, slots=True)
class Message:
    topic: str
    time_ns: int
    decoded: Any


class Viewer:
    """One connected viewer."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._decoders: dict[int, Callable[[bytes], Any]] = {}
        self._topics: dict[int, str] = {}
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.statuses: list[dict[str, Any]] = []
        while not self.channels:
            self._next()

    def subscribe(self, *topics: str) -> None:
        pairs = []
        for topic in topics:
            channel = self.channels[topic]
            number = channel["id"]
            schema = Schema(
                id=number,
                name=channel["schemaName"],
                encoding=channel["schemaEncoding"],
                data=base64.b64decode(channel["schema"]),
            )
            decoder = DecoderFactory().decoder_for(channel["encoding"], schema)
            assert decoder is not None
            self._decoders[number], self._topics[number] = decoder, topic
            pairs.append({"id": number, "channelId": number})
        self._send({"op": "subscribe", "subscriptions": pairs})

    def unsubscribe(self, *topics: str) -> None:
        numbers = [self.channels[topic]["id"] for topic in topics]
        self._send({"op": "unsubscribe", "subscriptionIds": numbers})

    def message(self, topic: str) -> Message:
        """Wait for a message on a topic."""
        while True:
            found = self._next()
            if found is not None and found.topic == topic:
                return found

    def frame(self, *topics: str) -> dict[str, Any]:
        """Wait until there was a message of the same time on all topics, and return them."""
        by_time: dict[int, dict[str, Any]] = {}
        while True:
            found = self._next()
            if found is not None:
                together = by_time.setdefault(found.time_ns, {})
                together[found.topic] = found.decoded
                if together.keys() >= set(topics):
                    return together

    def status(self, words: str) -> dict[str, Any]:
        """Wait for a status that contains these words, and forget it and those before it."""
        while True:
            for place, each in enumerate(self.statuses):
                if words in each["message"]:
                    del self.statuses[: place + 1]
                    return each
            self._next()

    def _next(self) -> Message | None:
        data = self._connection.recv(_WAIT_S)
        if isinstance(data, bytes):
            kind, number, time_ns = _MESSAGE.unpack_from(data)
            assert kind == 1
            decoded = self._decoders[number](data[_MESSAGE.size :])
            return Message(self._topics[number], time_ns, decoded)
        document = json.loads(data)
        if document["op"] == "serverInfo":
            self.info = document
        elif document["op"] == "advertise":
            self.channels |= {each["topic"]: each for each in document["channels"]}
        elif document["op"] == "status":
            self.statuses.append(document)
        return None

    def _send(self, document: dict[str, Any]) -> None:
        self._connection.send(json.dumps(document))


@contextmanager
def viewing(port: int) -> Iterator[Viewer]:
    """Connect a viewer until the end of the block."""
    spoken = [Subprotocol("foxglove.sdk.v1")]
    with connect(f"ws://127.0.0.1:{port}", subprotocols=spoken, max_size=None) as connection:
        yield Viewer(connection)
