"""Foxglove's WebSocket protocol, server side, behind the door of `transientcam.admission`.

The SDK's own server accepts every connection: it has no hook for the handshake, and what stands
before it would leave its port open to every user of the machine. The protocol is
https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md; of it are served channels,
parameters, services and statuses.
"""

import asyncio
import base64
import json
import struct
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from http import HTTPStatus
from typing import Any, Final, Protocol

from foxglove import Schema
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from transientcam.admission import Admission
from transientcam.errors import TransientcamError
from transientcam.transport import QUIET

SUBPROTOCOLS: Final = (Subprotocol("foxglove.sdk.v1"), Subprotocol("foxglove.websocket.v1"))
MOST_VIEWERS: Final = 32
MOST_MESSAGE_BYTES: Final = 256 * 1024
"""Of a message by a viewer: all parameters at once are a tenth of it."""
_BACKLOG: Final = 32
"""Messages kept for a viewer that is too slow; the oldest are dropped."""
_MOST_REPLIES: Final = 1024
"""Everything else that is kept for one; with more it is disconnected."""
_MOST_REQUESTS: Final = 16
_MESSAGE: Final = struct.Struct("<BIQ")
_CALL: Final = struct.Struct("<BIII")
_LEVELS: Final = {"info": 0, "warning": 1, "error": 2}


class Listener(Protocol):
    """Who is told what viewers look at, and answers what they ask, on threads of the server."""

    def subscribed(self, topic: str) -> None:
        """Count a viewer of a topic."""

    def unsubscribed(self, topic: str) -> None:
        """Discount one, also one whose connection broke."""

    def parameters(self, names: Iterable[str]) -> list[dict[str, Any]]:
        """Return parameters as the protocol has them; all, if none is named."""
        ...

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Set parameters."""

    def call(self, service: str) -> dict[str, Any]:
        """Return the response of a service; an error of this package is its refusal."""
        ...


class _Viewer:
    """What one connection is subscribed to, and what waits to be sent to it."""

    def __init__(self, connection: ServerConnection) -> None:
        self.connection = connection
        self.topics: dict[int, str] = {}
        self.followed: set[str] = set()
        """Parameters whose changes it is sent; with the name "" all."""
        self.requests: asyncio.Queue[Callable[[], object]] = asyncio.Queue(_MOST_REQUESTS)
        self._messages: deque[bytes] = deque(maxlen=_BACKLOG)
        self._replies: deque[bytes | str] = deque()
        self._something = asyncio.Event()

    def send(self, **document: Any) -> None:
        """Send a document, before all messages."""
        self.reply(json.dumps(document))

    def reply(self, data: bytes | str) -> None:
        """Send something that is not dropped."""
        if len(self._replies) >= _MOST_REPLIES:
            self.connection.transport.abort()
            return
        self._replies.append(data)
        self._something.set()

    def message(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message of a topic to each of its subscriptions to it."""
        for subscription, each in self.topics.items():
            if each == topic:
                self._messages.append(_MESSAGE.pack(1, subscription, time_ns) + data)
                self._something.set()

    async def write(self) -> None:
        """Send what waits, until the connection closes."""
        while True:
            await self._something.wait()
            self._something.clear()
            while self._replies or self._messages:
                queue = self._replies or self._messages
                await self.connection.send(queue.popleft())


class ViewerServer:
    """Serves channels, parameters and services to viewers, on a thread of its own.

    Methods may be called from any thread.

    ``name``: what viewers show.
    ``host``, ``port``: where; port 0 chooses a free one.
    ``admission``: who may enter.
    ``channels``: schema of the messages of each topic.
    ``services``: by name, the schemas of request and response, which are JSON.
    ``listener``: who answers.
    Raises OSError if nothing can be served there.
    """

    def __init__(
        self,
        *,
        name: str,
        host: str,
        port: int,
        admission: Admission,
        channels: Mapping[str, Schema],
        services: Mapping[str, tuple[Schema, Schema]],
        listener: Listener,
    ) -> None:
        self._name = name
        self._admission = admission
        self._topics = dict(enumerate(channels, 1))
        self._services = dict(enumerate(services, 1))
        self._greeting = _advertised(channels), _offered(services)
        self._listener = listener
        self._viewers: set[_Viewer] = set()
        self._operations: dict[str, Callable[[_Viewer, dict[str, Any]], None]] = {
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "getParameters": self._get_parameters,
            "setParameters": self._set_parameters,
            "subscribeParameterUpdates": self._follow,
            "unsubscribeParameterUpdates": self._unfollow,
        }
        # requests of viewers ask the daemon, and may have to wait for it
        self._asking = ThreadPoolExecutor(2, "viewers-ask")
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="viewers")
        self._thread.start()
        try:
            self._server = self._on_loop(self._begin(host, port))
        except OSError as error:
            self._end()
            raise OSError(error.errno, "cannot serve viewers", f"{host}:{port}") from error

    @property
    def port(self) -> int:
        """Where viewers connect to."""
        return int(next(iter(self._server.sockets)).getsockname()[1])

    def publish(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message to who is subscribed to its topic."""
        self._each(lambda viewer: viewer.message(topic, time_ns, data))

    def publish_status(self, text: str, level: str, about: str) -> None:
        """Show all viewers a status; it takes the place of the one before about the same."""
        document = {"op": "status", "level": _LEVELS[level], "message": text, "id": about}
        self._each(lambda viewer: viewer.send(**document))

    def publish_parameters(self, parameters: list[dict[str, Any]]) -> None:
        """Send parameters to who follows them."""
        self._soon(lambda: self._publish_parameters(parameters))

    def close(self) -> None:
        """Disconnect all viewers, and serve no more; once is enough."""
        if self._thread.is_alive():
            self._on_loop(self._finish())
            self._end()

    async def _begin(self, host: str, port: int) -> Server:
        return await serve(
            self._serve,
            host,
            port,
            subprotocols=SUBPROTOCOLS,
            process_request=self._admit,
            compression=None,
            max_size=MOST_MESSAGE_BYTES,
            close_timeout=1.0,
            logger=QUIET,
        )

    async def _finish(self) -> None:
        self._server.close()
        await self._server.wait_closed()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
        self._asking.shutdown()

    def _on_loop(self, work: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _each(self, do: Callable[[_Viewer], None]) -> None:
        def do_each() -> None:
            for viewer in self._viewers:
                do(viewer)

        self._soon(do_each)

    def _soon(self, work: Callable[[], object]) -> None:
        if not self._loop.is_closed():
            try:
                self._loop.call_soon_threadsafe(work)
            except RuntimeError:  # closed just now
                if not self._loop.is_closed():
                    raise

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        refusal = self._admission.refusal(
            request.path,
            hosts=request.headers.get_all("Host"),
            origins=request.headers.get_all("Origin"),
        )
        if refusal is not None:
            return connection.respond(HTTPStatus(refusal.status), refusal.reason + "\n")
        if len(self._viewers) >= MOST_VIEWERS:
            text = f"there are {MOST_VIEWERS} viewers\n"
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, text)
        return None

    async def _serve(self, connection: ServerConnection) -> None:
        viewer = _Viewer(connection)
        viewer.send(
            op="serverInfo",
            name=self._name,
            capabilities=["parameters", "parametersSubscribe", "services"],
            supportedEncodings=["json"],
            metadata={},
            sessionId=str(id(self)),
        )
        for document in self._greeting:
            viewer.reply(document)
        self._viewers.add(viewer)
        tasks = [asyncio.create_task(viewer.write()), asyncio.create_task(self._answer(viewer))]
        try:
            async for data in connection:
                self._received(viewer, data)
        except ConnectionClosed:
            pass
        finally:
            self._viewers.discard(viewer)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for topic in viewer.topics.values():
                self._listener.unsubscribed(topic)

    def _received(self, viewer: _Viewer, data: bytes | str) -> None:
        try:
            if isinstance(data, bytes):
                self._called(viewer, data)
            else:
                document = json.loads(data, parse_constant=_no_number)
                self._operations[document["op"]](viewer, document)
        except (ValueError, KeyError, TypeError, AttributeError, struct.error, RecursionError):
            text = "a message was not understood, or is not offered"
            viewer.send(op="status", level=_LEVELS["error"], message=text)

    def _subscribe(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        for each in document["subscriptions"]:
            number, topic = int(each["id"]), self._topics[int(each["channelId"])]
            if number in viewer.topics or not 0 <= number < 2**32:
                raise ValueError(number)
            if len(viewer.topics) >= len(self._topics):
                raise ValueError(number)  # each can be looked at once
            viewer.topics[number] = topic
            self._listener.subscribed(topic)

    def _unsubscribe(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        for each in document["subscriptionIds"]:
            self._listener.unsubscribed(viewer.topics.pop(int(each)))

    def _get_parameters(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        names, named = _names(document), _id_of(document)

        def answer() -> None:
            found = self._listener.parameters(names)
            self._soon(lambda: viewer.send(op="parameterValues", parameters=found, **named))

        self._ask(viewer, answer)

    def _set_parameters(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        values = {str(each["name"]): each.get("value") for each in document["parameters"]}
        named = _id_of(document)

        def change() -> None:
            self._listener.set_parameters(values)
            found = self._listener.parameters(())
            self._soon(lambda: viewer.send(op="parameterValues", parameters=found, **named))
            self._soon(lambda: self._publish_parameters(found, besides=viewer))

        self._ask(viewer, change)

    def _follow(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        viewer.followed |= set(_names(document) or ("",))

    def _unfollow(self, viewer: _Viewer, document: dict[str, Any]) -> None:
        viewer.followed -= set(_names(document) or viewer.followed)

    def _publish_parameters(
        self, parameters: list[dict[str, Any]], *, besides: _Viewer | None = None
    ) -> None:
        for viewer in self._viewers - {besides}:
            every = "" in viewer.followed
            found = [each for each in parameters if every or each["name"] in viewer.followed]
            if found:
                viewer.send(op="parameterValues", parameters=found)

    def _called(self, viewer: _Viewer, data: bytes) -> None:
        kind, service, call, length = _CALL.unpack_from(data)
        encoding = data[_CALL.size : _CALL.size + length]
        if kind != 2 or encoding != b"json":
            raise ValueError(kind)
        name = self._services[service]

        def answer() -> None:
            try:
                response = json.dumps(self._listener.call(name)).encode()
            except TransientcamError as error:
                document = {"serviceId": service, "callId": call, "message": str(error)}
                self._soon(lambda: viewer.send(op="serviceCallFailure", **document))
                return
            head = _CALL.pack(3, service, call, length) + encoding
            self._soon(lambda: viewer.reply(head + response))

        self._ask(viewer, answer)

    def _ask(self, viewer: _Viewer, request: Callable[[], object]) -> None:
        """Answer a request on another thread, after those before it."""
        try:
            viewer.requests.put_nowait(request)
        except asyncio.QueueFull:
            text = f"{_MOST_REQUESTS} requests wait already"
            viewer.send(op="status", level=_LEVELS["error"], message=text)

    async def _answer(self, viewer: _Viewer) -> None:
        while True:
            request = await viewer.requests.get()
            await self._loop.run_in_executor(self._asking, request)


def _names(document: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(str(each) for each in document["parameterNames"])


def _id_of(document: Mapping[str, Any]) -> dict[str, str]:
    return {"id": str(document["id"])} if "id" in document else {}


def _no_number(text: str) -> None:
    raise ValueError(text)


def _advertised(channels: Mapping[str, Schema]) -> str:
    described = [
        {
            "id": number,
            "topic": topic,
            "encoding": schema.encoding,
            "schemaName": schema.name,
            "schemaEncoding": schema.encoding,
            "schema": base64.b64encode(schema.data).decode(),
        }
        for number, (topic, schema) in enumerate(channels.items(), 1)
    ]
    return json.dumps({"op": "advertise", "channels": described})


def _offered(services: Mapping[str, tuple[Schema, Schema]]) -> str:
    described = [
        {
            "id": number,
            "name": name,
            "type": f"transientcam{name}",
            "request": _of_service(request),
            "response": _of_service(response),
        }
        for number, (name, (request, response)) in enumerate(services.items(), 1)
    ]
    return json.dumps({"op": "advertiseServices", "services": described})


def _of_service(schema: Schema) -> dict[str, str]:
    return {
        "encoding": "json",
        "schemaName": schema.name,
        "schemaEncoding": schema.encoding,
        "schema": schema.data.decode(),
    }
