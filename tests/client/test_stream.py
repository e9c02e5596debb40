"""Streams over a real socket, the synchronous and the asynchronous one alike."""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from websockets.http11 import Request, Response
from websockets.sync.server import ServerConnection

from tests.client.conftest import Recording, ReplayServer
from transientcam import AsyncCamera, Camera, Frame, Notice, Reconnect, wire
from transientcam.errors import (
    FrameTimeout,
    ProblemError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)

_Start = Callable[..., ReplayServer]
_QUICK = Reconnect(first_wait_s=0.01, longest_wait_s=0.05)


class _Sync:
    """Drives `Camera.stream`."""

    def __init__(self, url: str, *products: str, **options: Any) -> None:
        self._camera = Camera(url, timeout_s=60.0)
        self.stream = self._camera.stream(*products, **options)

    def receive(self, **options: Any) -> Frame:
        return self.stream.receive(**options)

    def all(self) -> list[Frame]:
        return list(self.stream)

    def subscribe(self, *products: str) -> None:
        self.stream.subscribe(*products)

    def close(self) -> None:
        self._camera.close()

    def end(self) -> None:
        """Release what drives the stream."""


class _Async:
    """Drives `AsyncCamera.stream`, in the same way."""

    def __init__(self, url: str, *products: str, **options: Any) -> None:
        self._runner = asyncio.Runner()
        self._camera = AsyncCamera(url, timeout_s=60.0)
        self.stream = self._camera.stream(*products, **options)

    def receive(self, **options: Any) -> Frame:
        return self._runner.run(self.stream.receive(**options))

    def all(self) -> list[Frame]:
        async def collect() -> list[Frame]:
            return [frame async for frame in self.stream]

        return self._runner.run(collect())

    def subscribe(self, *products: str) -> None:
        self._runner.run(self.stream.subscribe(*products))

    def close(self) -> None:
        self._runner.run(self._camera.close())

    def end(self) -> None:
        self._runner.close()


_Client = _Sync | _Async
_Connect = Callable[..., _Client]


@pytest.fixture(params=[_Sync, _Async], ids=["sync", "async"])
def connect(request: pytest.FixtureRequest, replay: _Start) -> Iterator[_Connect]:
    """Make clients that are closed after the test, and before its servers are."""
    clients: list[_Client] = []

    def make(url: str, *products: str, **options: Any) -> _Client:
        client: _Client = request.param(url, *(products or ("range",)), **options)
        clients.append(client)
        return client

    yield make
    for client in clients:
        client.close()
        client.end()


def _frame(number: int, shape: tuple[int, ...] = (1, 1)) -> bytes:
    return wire.encode_frame(
        product="range",
        unit="m",
        axes=("y", "x"),
        meta={"frame": number},
        array=np.full(shape, number, "<f4"),
        channel=0,
    )


def _until_gone(connection: ServerConnection) -> None:
    """Read on until the client leaves."""
    for _ in connection:
        pass


def test_a_subscription_is_answered_with_frames(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    first: list[bytes | str] = []

    def handler(connection: ServerConnection) -> None:
        first.append(connection.recv())
        connection.send(recorded["hello"].data)
        connection.send(recorded["frame"].data)

    server = replay(handler)
    client = connect(server.url, "range", credits=3, max_rate_hz=5.0)

    frame = client.receive(timeout_s=60.0)

    assert (frame.frame, frame.product, frame.unit) == (17, "range", "m")
    assert wire.parse_client_message(first[0]) == wire.Subscribe(
        (wire.Subscription("range", 5.0),), credits=3
    )
    assert client.stream.hello is not None
    assert client.stream.hello.session == "5f0c"
    assert client.stream.channels[0].shape == (2, 2)
    assert client.stream.sequence == {"harmonics": 3}


def test_asking_for_the_next_frame_acknowledges_the_one_before(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    acknowledged: list[wire.ClientMessage] = []

    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        for number in (1, 2, 3):
            connection.send(_frame(number))
            # nothing more is sent until the client says that it is done
            acknowledged.append(wire.parse_client_message(connection.recv()))
        connection.close()

    client = connect(replay(handler).url, credits=1)

    assert [frame.frame for frame in client.all()] == [1, 2, 3]
    assert acknowledged == [wire.Ack(1), wire.Ack(2), wire.Ack(3)]


def test_a_frame_far_longer_than_the_usual_limit_of_a_message_arrives(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(_frame(1, shape=(2200, 2000)))  # 17.6 MB
        _until_gone(connection)

    client = connect(replay(handler).url)

    frame = client.receive(timeout_s=60.0)

    assert frame.array.shape == (2200, 2000)
    assert (frame.array == 1.0).all()


def test_notices_are_delivered_while_frames_are_waited_for(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        for name in ("hello", "notice", "frame"):
            connection.send(recorded[name].data)
        _until_gone(connection)

    passed: list[Notice] = []
    client = connect(replay(handler).url, on_notice=passed.append)

    client.receive(timeout_s=60.0)

    assert [notice.kind for notice in passed] == ["dropped"]
    assert list(client.stream.notices) == passed


def test_no_frame_in_time_is_an_error_and_the_stream_stays(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    more = threading.Event()

    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        more.wait(60.0)
        connection.send(_frame(1))
        _until_gone(connection)

    client = connect(replay(handler).url)

    with pytest.raises(FrameTimeout, match=r"within 0\.05 s"):
        client.receive(timeout_s=0.05)
    more.set()

    assert client.receive(timeout_s=60.0).frame == 1


def test_a_refused_subscription_is_raised_with_its_reason(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["error"].data)
        connection.close(4001, "bad first message")

    client = connect(replay(handler).url, reconnect=_QUICK)

    with pytest.raises(ProblemError, match="/problems/bad-message"):
        client.receive(timeout_s=60.0)
    with pytest.raises(StreamClosed) as caught:
        client.receive(timeout_s=60.0)
    assert caught.value.code == 4001


@pytest.mark.parametrize("data", [b"\xc1", "text", b"\x81\xa4type\xa1x"])
def test_bytes_that_are_no_message_are_one_error(
    connect: _Connect, replay: _Start, data: bytes | str
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(data)
        _until_gone(connection)

    client = connect(replay(handler).url)

    with pytest.raises(ProtocolError):
        client.receive(timeout_s=60.0)


def test_a_server_without_the_subprotocol_is_refused(connect: _Connect, replay: _Start) -> None:
    client = connect(replay(_until_gone, subprotocols=None).url)

    with pytest.raises(ProtocolError, match="subprotocol is None"):
        client.receive(timeout_s=60.0)


def test_a_redirect_is_not_followed_and_no_token_goes_there(
    connect: _Connect, replay: _Start
) -> None:
    received: list[object] = []

    def thief(connection: ServerConnection) -> None:
        received.extend(connection)

    elsewhere = replay(thief)

    def send_there(connection: ServerConnection, request: Request) -> Response:
        response = connection.respond(302, "")
        response.headers["Location"] = f"ws://127.0.0.1:{elsewhere.port}/api/v1/stream"
        return response

    server = replay(lambda _: None, process_request=send_there)
    with pytest.raises(TransientcamError):
        connect(server.url, "range").receive()
    assert received == []


@pytest.mark.parametrize("code", [1001, 1011, 1013, 4003])
def test_the_end_of_a_stream_is_raised_with_its_reason(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording], code: int
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.close(code, "so it is")

    client = connect(replay(handler).url)

    with pytest.raises(StreamClosed, match="so it is") as caught:
        client.all()
    assert caught.value.code == code


def test_a_connection_that_just_breaks_is_reported(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.socket.shutdown(2)

    client = connect(replay(handler).url)

    with pytest.raises(StreamClosed) as caught:
        client.receive(timeout_s=60.0)
    assert caught.value.code == 1006


def test_a_stream_comes_back_after_the_server_did(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def first(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(_frame(41))
        connection.recv()  # the acknowledgement of the frame
        connection.close(1001, "the service shuts down")

    def second(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(_frame(1))
        _until_gone(connection)

    back: list[ReplayServer] = []
    server = replay(first)

    def on_notice(notice: Notice) -> None:
        if notice.kind == "connection-lost":
            # only now another one starts, at the same address
            server.close()
            back.append(replay(second, port=server.port))

    client = connect(server.url, reconnect=_QUICK, on_notice=on_notice)

    assert client.receive(timeout_s=60.0).frame == 41
    assert client.receive(timeout_s=60.0).frame == 1

    assert [notice.kind for notice in client.stream.notices] == ["connection-lost", "reconnected"]
    assert "the service shuts down" in client.stream.notices[0].details["reason"]


def test_attempts_end_with_the_error_when_they_are_used_up(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.close(1001)

    server = replay(handler)
    client = connect(
        server.url,
        reconnect=Reconnect(first_wait_s=0.01, attempts=2),
        on_notice=lambda notice: server.close(),
    )

    with pytest.raises(ServerUnreachable):
        client.all()


def test_a_deadline_holds_while_the_server_is_away(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.close(1001)

    client = connect(
        replay(handler).url, reconnect=Reconnect(first_wait_s=600.0, longest_wait_s=600.0)
    )

    with pytest.raises(FrameTimeout):
        client.receive(timeout_s=60.0)


def test_another_subscription_can_be_asked_for_at_any_time(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    received: list[wire.ClientMessage] = []

    def handler(connection: ServerConnection) -> None:
        for data in connection:
            received.append(wire.parse_client_message(data))
            if isinstance(received[-1], wire.Subscribe):
                connection.send(recorded["hello"].data)
                connection.send(_frame(len(received)))

    client = connect(replay(handler).url, "range")
    client.receive(timeout_s=60.0)

    client.subscribe("coefficients")
    frame = client.receive(timeout_s=60.0)

    assert frame.frame == 2
    assert isinstance(received[1], wire.Subscribe)
    assert received[1].subscriptions == (wire.Subscription("coefficients"),)


def test_a_closed_stream_gives_no_frames(
    connect: _Connect, replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(_frame(1))
        _until_gone(connection)

    client = connect(replay(handler).url)
    client.receive(timeout_s=60.0)

    client.close()

    assert client.stream.closed
    assert client.all() == []
    with pytest.raises(StreamClosed, match="closed here"):
        client.receive()


def _endless(recorded: dict[str, Recording]) -> Callable[[ServerConnection], None]:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        with contextlib.suppress(Exception):  # the client leaves when it likes
            for number in range(1, 1_000_000):
                connection.send(_frame(number))

    return handler


def test_leaving_a_loop_closes_its_stream(replay: _Start, recorded: dict[str, Recording]) -> None:
    with Camera(replay(_endless(recorded)).url) as camera:
        stream = camera.stream("range")
        for frame in stream:
            if frame.frame == 3:
                break
        assert stream.closed


def test_leaving_a_loop_keeps_a_stream_that_was_entered(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    with Camera(replay(_endless(recorded)).url) as camera, camera.stream("range") as stream:
        assert stream.hello is None or stream.hello.session == "5f0c"
        for _ in stream:
            break
        assert not stream.closed
        assert stream.receive(timeout_s=60.0).frame == 2


def test_an_asynchronous_stream_is_a_context_manager_too(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    async def run(url: str) -> list[int]:
        numbers = []
        async with AsyncCamera(url) as camera, camera.stream("range") as stream:
            async for frame in stream:
                numbers.append(frame.frame)
                if frame.frame == 3:
                    break
        assert stream.closed
        return numbers

    assert asyncio.run(run(replay(_endless(recorded)).url)) == [1, 2, 3]


def test_another_thread_can_close_a_stream_that_waits(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(recorded["notice"].data)
        _until_gone(connection)

    waiting = threading.Event()
    with Camera(replay(handler).url) as camera:
        stream = camera.stream("range", on_notice=lambda notice: waiting.set(), reconnect=True)
        frames: list[Frame] = []
        thread = threading.Thread(target=lambda: frames.extend(stream))
        thread.start()
        assert waiting.wait(60.0)

        stream.close()
        thread.join(60.0)

        assert not thread.is_alive()
        assert frames == []


def test_another_task_can_close_a_stream_that_waits(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.send(recorded["notice"].data)
        _until_gone(connection)

    async def run(url: str) -> list[Frame]:
        waiting = asyncio.Event()
        async with AsyncCamera(url) as camera:
            stream = camera.stream("range", on_notice=lambda notice: waiting.set(), reconnect=True)

            async def collect() -> list[Frame]:
                return [frame async for frame in stream]

            task = asyncio.create_task(collect())
            await asyncio.wait_for(waiting.wait(), 60.0)
            await stream.close()
            return await asyncio.wait_for(task, 60.0)

    assert asyncio.run(run(replay(handler).url)) == []


def test_closing_ends_a_wait_for_a_server_that_is_away(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    def handler(connection: ServerConnection) -> None:
        connection.recv()
        connection.send(recorded["hello"].data)
        connection.close(1001)

    lost = threading.Event()
    with Camera(replay(handler).url) as camera:
        stream = camera.stream(
            "range",
            reconnect=Reconnect(first_wait_s=600.0, longest_wait_s=600.0),
            on_notice=lambda notice: lost.set(),
        )
        thread = threading.Thread(target=lambda: list(stream))
        thread.start()
        assert lost.wait(60.0)

        stream.close()
        thread.join(60.0)

        assert not thread.is_alive()


def test_closing_while_a_connection_is_made_leaves_no_connection(
    replay: _Start, recorded: dict[str, Recording]
) -> None:
    handshaking, go_on, gone = threading.Event(), threading.Event(), threading.Event()

    def hesitate(connection: ServerConnection, request: object) -> None:
        handshaking.set()
        go_on.wait(60.0)

    def handler(connection: ServerConnection) -> None:
        _until_gone(connection)
        gone.set()

    with Camera(replay(handler, process_request=hesitate).url) as camera:
        stream = camera.stream("range")
        thread = threading.Thread(target=lambda: list(stream))
        thread.start()
        assert handshaking.wait(60.0)

        stream.close()
        go_on.set()

        thread.join(60.0)
        assert not thread.is_alive()
        assert gone.wait(60.0)
