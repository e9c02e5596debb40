"""The door of the bridge: who reads, changes and lights what, and what a viewer may send."""

import json
from collections import deque
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import Any, cast

import foxglove
import httpx
import pytest
from foxglove import Schema
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from tests.client.robotics.viewer import _MESSAGE, SPOKEN, Viewer, viewing
from transientcam import Camera
from transientcam.admission import Admission
from transientcam.robotics import FoxgloveBridge
from transientcam.robotics._viewer_server import MOST_MESSAGE_BYTES, ViewerServer

EVIL = Origin("https://evil.example")
LENS = {"fx": 3.0, "fy": 4.0, "cx": 1.0, "cy": 2.0, "width": 5, "height": 6, "source": "scene"}


class Daemon:
    """Answers as a daemon whose camera is stopped, and keeps what would have changed it."""

    def __init__(self) -> None:
        self.changes: list[tuple[str, Any]] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        what = request.url.path.rpartition("/")[2]
        if request.method in ("PUT", "POST", "DELETE") and what != "lease":
            self.changes.append((what, json.loads(request.content)))
        return httpx.Response(200, json=self._document(what))

    def _document(self, what: str) -> dict[str, Any]:
        def parameter(name: str, value: Any) -> dict[str, Any]:
            document, _, key = name.partition(".")
            kind = type(value).__name__
            return {
                "name": name,
                "value": value,
                "type": kind,
                "access": "read-write",
                "resource": f"/api/v1/{document}",
                "pointer": f"/{key}",
            }

        documents: dict[str, dict[str, Any]] = {
            "camera": {"intrinsics": LENS},
            "parameters": {
                "parameters": [
                    parameter("sequence.harmonics", 3),
                    parameter("acquisition.running", False),
                ]
            },
            "sequence": {"harmonics": 3, "capture_s": 0.001},
            "acquisition": {"running": False},
            "frames": {"first": 1, "last": 7},
            "latest": {"frame": 8},
            "lease": {"lease_id": "l"},
        }
        return documents.get(what, {})


@contextmanager
def bridged(**options: Any) -> Iterator[tuple[FoxgloveBridge, Daemon]]:
    daemon = Daemon()
    transport = httpx.MockTransport(daemon)
    with (
        Camera("http://camera", token="t0ken", transport=transport) as camera,
        FoxgloveBridge(camera, port=0, **options) as bridge,
    ):
        yield bridge, daemon


def read(viewer: Viewer) -> bool:
    return viewer.parameters("sequence.harmonics") == {"sequence.harmonics": 3}


def change(viewer: Viewer) -> None:
    viewer.set_parameters(sequence__harmonics=4)


def light(viewer: Viewer) -> None:
    viewer.set_parameters(acquisition__running=True)
    viewer.set_parameters(acquisition__running=1)
    viewer.set_parameters(sequence__harmonics=3, acquisition__running=True)
    viewer.call("/capture")


STARTED = ("acquisition", {"running": True})


@pytest.mark.parametrize("options", [{}, {"control": True}, {"control_light": True}])
@pytest.mark.parametrize("use", [read, change, light])
@pytest.mark.parametrize("who", ["no secret", "old secret", "foreign origin", "rebound name"])
def test_who_is_refused_reads_changes_and_lights_nothing(
    who: str, use: Any, options: dict[str, bool]
) -> None:
    with bridged(**options) as (bridge, daemon):
        base = bridge.url.rpartition("/")[0]
        url, origin, host = {
            "no secret": (base, None, None),
            "old secret": (f"{base}/AAAAAAAAAAAAAAAAAAAAAA", None, None),
            "foreign origin": (bridge.url, EVIL, None),
            "rebound name": (bridge.url, None, "evil.example"),
        }[who]
        with pytest.raises(InvalidStatus), viewing(url, origin=origin, host=host) as viewer:
            use(viewer)
        assert daemon.changes == []


@pytest.mark.parametrize(
    ("options", "changes", "lights"),
    [({}, False, False), ({"control": True}, True, False), ({"control_light": True}, True, True)],
)
def test_who_enters_does_what_the_bridge_was_given(
    options: dict[str, bool], changes: bool, lights: bool
) -> None:
    with bridged(**options) as (bridge, daemon), viewing(bridge.url) as viewer:
        assert read(viewer)
        change(viewer)
        assert [name for name, _ in daemon.changes] == ["sequence"] * changes
        daemon.changes.clear()
        viewer.set_parameters(acquisition__running=False)
        assert daemon.changes == [("acquisition", {"running": False})] * changes
        daemon.changes.clear()
        light(viewer)
        assert (STARTED in daemon.changes) is lights


def test_a_page_that_is_named_enters_with_the_secret() -> None:
    with bridged(origins=[EVIL]) as (bridge, _), viewing(bridge.url, origin=EVIL) as viewer:
        assert read(viewer)


class Nobody:
    """A listener that has nothing, and keeps what it is told."""

    def __init__(self) -> None:
        self.looked_at: list[str] = []

    def subscribed(self, topic: str) -> None:
        self.looked_at.append(topic)

    def unsubscribed(self, topic: str) -> None:
        self.looked_at.remove(topic)

    def parameters(self, names: Any) -> list[dict[str, Any]]:
        return [{"name": "a", "value": 1.0, "type": "float64"}]

    def set_parameters(self, values: Any) -> None:
        raise AssertionError(values)

    def call(self, service: str) -> dict[str, Any]:
        return {"service": service}


SCHEMA = Schema(name="Thing", encoding="protobuf", data=b"\x0a\x03abc")
JSON = Schema(name="Object", encoding="jsonschema", data=b'{"type": "object"}')


@contextmanager
def open_server() -> Iterator[tuple[ViewerServer, Nobody, str]]:
    nobody = Nobody()
    with closing(
        ViewerServer(
            name="thing",
            host="127.0.0.1",
            port=0,
            admission=Admission("127.0.0.1", secret=None),
            channels={"/thing": SCHEMA},
            services={"/do": (JSON, JSON)},
            listener=nobody,
        )
    ) as server:
        yield server, nobody, f"ws://127.0.0.1:{server.port}"


def test_it_announces_what_the_sdk_does() -> None:
    context = foxglove.Context()
    channel = foxglove.Channel(
        "/thing", schema=SCHEMA, message_encoding="protobuf", context=context
    )
    schema = foxglove.MessageSchema(encoding="json", schema=JSON)
    described = foxglove.ServiceSchema("transientcam/do", request=schema, response=schema)
    sdk = foxglove.start_server(
        name="thing",
        port=0,
        capabilities=[foxglove.Capability.Parameters, foxglove.Capability.Services],
        supported_encodings=["json"],
        services=[foxglove.websocket.Service("/do", schema=described, handler=lambda _: b"{}")],
        context=context,
    )
    try:
        with (
            open_server() as (_, _, url),
            viewing(url) as ours,
            viewing(f"ws://127.0.0.1:{sdk.port}") as theirs,
        ):
            for viewer in (ours, theirs):
                while "/do" not in viewer.services:
                    viewer._next()
                for each in (viewer.info, *viewer.channels.values(), *viewer.services.values()):
                    for own in ("sessionId", "id", "metadata"):
                        each.pop(own, None)
            assert ours.channels == theirs.channels
            assert ours.services == theirs.services
            assert set(ours.info.pop("capabilities")) == set(theirs.info.pop("capabilities"))
            assert ours.info == theirs.info
    finally:
        sdk.stop()
        channel.close()


def ask(connection: ClientConnection) -> dict[str, Any]:
    """Ask for parameters, and return the first answer that is about a request."""
    connection.send(json.dumps({"op": "getParameters", "parameterNames": []}))
    while True:
        data = connection.recv(30.0)
        document = json.loads(data)
        if document["op"] in ("status", "parameterValues"):
            return dict(document)


@pytest.mark.parametrize(
    "message",
    [
        b"",
        b"\x02",
        b"\x02" + bytes(12),
        b"\x02\xff\xff\xff\xff" + bytes(8),
        b"\x01" + bytes(30),
        "",
        "null",
        "[" * 100_000,
        '{"op": "nothing"}',
        '{"op": ["subscribe"]}',
        '{"op": "subscribe"}',
        '{"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}',
        '{"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}',
        '{"op": "subscribe", "subscriptions": [{"id": NaN, "channelId": 1}]}',
        '{"op": "unsubscribe", "subscriptionIds": [5]}',
        '{"op": "setParameters", "parameters": [[]]}',
        '{"op": "setParameters", "parameters": [{"name": "a", "value": NaN}]}',
        '{"op": "getParameters", "parameterNames": 5}',
    ],
)
def test_what_is_not_understood_is_said_and_the_viewer_stays(message: str | bytes) -> None:
    with open_server() as (_, nobody, url), connect(url, subprotocols=SPOKEN) as connection:
        connection.send(message)
        assert ask(connection)["op"] == "status"
        assert ask(connection)["op"] == "parameterValues"
        assert nobody.looked_at == []


def test_a_message_that_is_too_large_ends_its_viewer_only() -> None:
    with open_server() as (_, _, url), viewing(url) as other:
        with connect(url, subprotocols=SPOKEN) as connection:
            connection.send("x" * (MOST_MESSAGE_BYTES + 1))
            with pytest.raises(ConnectionClosed):
                deque(iter(lambda: connection.recv(30.0), None), maxlen=0)
        assert other.parameters() == {"a": 1.0}


def test_what_is_looked_at_twice_is_served_once_and_let_go_at_the_end() -> None:
    twice = {"op": "subscribe", "subscriptions": [{"id": n, "channelId": 1} for n in (1, 2)]}
    with open_server() as (_, nobody, url), connect(url, subprotocols=SPOKEN) as connection:
        connection.send(json.dumps(twice))
        assert ask(connection)["op"] == "status"
        assert nobody.looked_at == ["/thing"]
    assert nobody.looked_at == []


def test_a_viewer_that_does_not_read_is_not_waited_for_and_loses_the_oldest() -> None:
    subscribe = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]}
    with (
        open_server() as (server, _, url),
        viewing(url) as reads,
        connect(url, subprotocols=SPOKEN, max_queue=1, max_size=None) as stuck,
    ):
        stuck.send(json.dumps(subscribe))
        ask(stuck)
        for number in range(100):
            server.publish("/thing", number, bytes(10**6))
        assert reads.parameters() == {"a": 1.0}  # the loop is not held up
        times = [_MESSAGE.unpack_from(cast("bytes", stuck.recv(30.0)))[2]]
        while times[-1] != 99:
            times.append(_MESSAGE.unpack_from(cast("bytes", stuck.recv(30.0)))[2])
    assert times == sorted(times)
    assert times[-32:] == list(range(68, 100))
    assert len(times) < 100
