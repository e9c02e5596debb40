"""A viewer of Foxglove's WebSocket protocol, written for tests; a library decodes messages.

Its words are those of the protocol's specification: text frames are JSON with ``op``; a binary
frame is 1, the subscription (u32), the time in ns (u64), all little-endian, and the message. A call
of a service is 2, the service (u32), the call (u32), the length (u32) and name of the encoding, and
the request; its response is 3 and the same.
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
from websockets.typing import Origin, Subprotocol

from tests.client.robotics.reporting import WAIT_S

SPOKEN = [Subprotocol("foxglove.sdk.v1")]
_MESSAGE = struct.Struct("<BIQ")
_CALL = struct.Struct("<BIII")
_ENCODING = b"json"


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
        self.services: dict[str, dict[str, Any]] = {}
        self._values: list[dict[str, Any]] = []
        self._answers: list[dict[str, Any]] = []
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

    def parameters(self, *names: str) -> dict[str, Any]:
        """Ask for parameters; all, if none is named."""
        self._send({"op": "getParameters", "parameterNames": names, "id": "get"})
        return self._values_of("get")

    def set_parameters(self, **values: Any) -> dict[str, Any]:
        """Set parameters, ``__`` for a dot; return all as they are then."""
        pairs = [{"name": name.replace("__", "."), "value": each} for name, each in values.items()]
        self._send({"op": "setParameters", "parameters": pairs, "id": "set"})
        return self._values_of("set")

    def follow_parameters(self, *names: str) -> None:
        """Ask to be sent these parameters when they change."""
        self._send({"op": "subscribeParameterUpdates", "parameterNames": names})

    def update(self) -> dict[str, Any]:
        """Wait for parameters that were not asked for."""
        return self._values_of(None)

    def call(self, service: str) -> dict[str, Any]:
        """Call a service with an empty object, and wait for its response or its refusal."""
        while service not in self.services:
            self._next()
        number = self.services[service]["id"]
        head = _CALL.pack(2, number, 1, len(_ENCODING))
        self._connection.send(head + _ENCODING + b"{}")
        while not self._answers:
            self._next()
        return self._answers.pop()

    def _values_of(self, request: str | None) -> dict[str, Any]:
        while True:
            for place, each in enumerate(self._values):
                if each.get("id") == request:
                    del self._values[place]
                    return {one["name"]: one["value"] for one in each["parameters"]}
            self._next()

    def _next(self) -> Message | None:
        data = self._connection.recv(WAIT_S)
        if isinstance(data, bytes) and data[0] == 3:
            length = _CALL.unpack_from(data)[3]
            self._answers.append(json.loads(data[_CALL.size + length :]))
            return None
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
        elif document["op"] == "advertiseServices":
            self.services |= {each["name"]: each for each in document["services"]}
        elif document["op"] == "parameterValues":
            self._values.append(document)
        elif document["op"] == "serviceCallFailure":
            self._answers.append(document)
        return None

    def _send(self, document: dict[str, Any]) -> None:
        self._connection.send(json.dumps(document))


@contextmanager
def viewing(url: str, *, origin: Origin | None = None, host: str | None = None) -> Iterator[Viewer]:
    """Connect a viewer until the end of the block; ``host`` as the header of that name."""
    headers = None if host is None else {"Host": host}
    with connect(
        url, subprotocols=SPOKEN, max_size=None, origin=origin, additional_headers=headers
    ) as connection:
        yield Viewer(connection)
