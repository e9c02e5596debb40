import time
from typing import Any

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus

from tests.server.streaming import VIDEO, streaming
from tests.serving import Served, serving
from transientcam import wire
from transientcam_driver import Sequence


def test_hello_describes_the_channels_and_frames_follow_it(served: Served) -> None:
    with streaming(served.stream_url) as client:
        hello = client.subscribe("range", "coefficients")
        frames = [client.frame() for _ in range(4)]

    assert hello.server["name"] == "transientcam"
    assert hello.sequence == served.camera.applied.to_document()
    assert [channel.product for channel in hello.channels] == ["range", "coefficients"]
    assert [channel.shape for channel in hello.channels] == [(120, 163), (7, 120, 163)]
    channels = {channel.product: channel for channel in hello.channels}
    for frame in frames:
        channel = channels[frame.product]
        assert frame.channel == channel.channel
        assert frame.array.shape == channel.shape
        assert frame.array.dtype.str == channel.dtype
        assert (frame.unit, frame.axes) == (channel.unit, channel.axes)


def test_the_products_of_a_frame_come_together_in_the_order_asked_for(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("direct", "range", "flags")
        frames = [client.frame() for _ in range(9)]

    assert [frame.product for frame in frames] == ["direct", "range", "flags"] * 3
    numbers = [frame.meta["frame"] for frame in frames]
    assert numbers[0::3] == numbers[1::3] == numbers[2::3]
    assert numbers[0] < numbers[3] < numbers[6]


def test_the_stream_sends_what_rest_answers(served: Served) -> None:
    import httpx

    with streaming(served.stream_url) as client, httpx.Client(base_url=served.url) as http:
        client.subscribe("range")
        client.frame()
        http.put("/api/v1/acquisition", json={"running": False})
        rest = wire.parse_frame(http.get("/api/v1/frames/latest/range").content)
        frame = client.frame()
        while frame.meta["frame"] < rest.meta["frame"]:
            frame = client.frame()

    np.testing.assert_array_equal(frame.array, rest.array)


def test_data_starts_at_a_multiple_of_eight_bytes(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("coefficients")
        data = client.connection.recv(timeout=10.0)

    assert isinstance(data, bytes)
    size = wire.parse_frame(data).array.nbytes
    assert (len(data) - size) % wire.ALIGNMENT == 0


def test_a_rate_limit_thins_one_channel_and_leaves_the_other(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.send(
            {
                "type": "subscribe",
                "v": 1,
                "subscriptions": [
                    {"product": "flags"},
                    {"product": "range", "max_rate_hz": 2.0},
                ],
            }
        )
        frames = [client.frame() for _ in range(14)]

    times_s = {name: [f.meta["device_time_s"] for f in frames if f.product == name]
               for name in ("flags", "range")}  # fmt: skip
    assert len(times_s["flags"]) > 3 * len(times_s["range"]) > 0
    assert np.diff(times_s["range"]).min() > 0.4


def test_a_new_subscription_replaces_the_old_one(served: Served) -> None:
    with streaming(served.stream_url) as client:
        first = client.subscribe("range")
        client.frame()
        second = client.subscribe("direct")

        assert first.session == second.session
        # a frame of the old one may have been on its way
        products = [client.frame().product for _ in range(3)]
        assert products[-2:] == ["direct", "direct"]


def test_with_credits_the_server_waits_for_the_client_and_then_sends_the_newest(
    served: Served,
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("range", credits=1)
        first = client.frame()
        with pytest.raises(TimeoutError):
            client.receive(timeout_s=0.5)
        waited_for = served.service.hub.latest
        assert waited_for is not None

        client.send({"type": "ack", "frame": first.meta["frame"]})
        dropped = client.notice("dropped")
        second = client.frame()

    assert second.meta["frame"] >= waited_for.number
    skipped = second.meta["frame"] - first.meta["frame"] - 1
    assert dropped.details == {
        "channel": first.channel,
        "count": skipped,
        "total": skipped,
    }


def test_a_start_in_the_past_says_what_is_missing(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        while client.frame().meta["frame"] < 4:
            pass
        client.subscribe("flags", start=1)
        gap = client.notice("gap")
        frame = client.frame()

    assert gap.details["from"] == 1
    assert gap.details["to"] == frame.meta["frame"] - 1


def test_a_changed_sequence_is_told_before_its_first_frame(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("moments")
        client.frame()
        applied = served.service.acquisition.configure(Sequence(harmonics=4)).result(10.0)
        notice = client.notice("sequence-changed")
        frame = client.frame()
        while frame.meta["sequence_id"] != applied.epoch:
            frame = client.frame()

    assert notice.details["sequence"] == applied.to_document()
    (channel,) = wire.parse_channels(notice.details)
    assert channel.shape == frame.array.shape == (5, 120, 163)


def test_frames_come_at_the_rate_of_the_camera_and_none_goes_missing_untold(
    served: Served,
) -> None:
    served.service.acquisition.configure(Sequence.from_document(VIDEO)).result(10.0)
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        messages = [client.receive() for _ in range(25)]

    frames = [message for message in messages if isinstance(message, wire.Frame)]
    dropped = sum(
        message.details["count"]
        for message in messages
        if isinstance(message, wire.Notice) and message.kind == "dropped"
    )
    numbers = [frame.meta["frame"] for frame in frames]
    assert numbers[-1] - numbers[0] + 1 == len(frames) + dropped
    # by the camera's clock, so that a busy machine does not matter: the paper's video rate
    interval_s = np.diff([frame.meta["device_time_s"] for frame in frames]).min()
    assert 1.0 / interval_s == pytest.approx(18.6, abs=0.01)


@pytest.mark.parametrize("offered", [None, ["mqtt"], ["transientcam.v2.msgpack"]])
def test_a_handshake_without_the_subprotocol_is_refused_with_a_problem(
    served: Served, offered: Any
) -> None:
    with (
        pytest.raises(InvalidStatus) as caught,
        streaming(served.stream_url, subprotocols=offered),
    ):
        pass

    response = caught.value.response
    assert response.status_code == 400
    assert response.headers["content-type"] == "application/problem+json"
    assert b"subprotocol-required" in (response.body or b"")


def test_the_subprotocol_is_chosen_among_several(served: Served) -> None:
    with streaming(served.stream_url, subprotocols=["mqtt", wire.SUBPROTOCOL]) as client:
        assert client.connection.subprotocol == wire.SUBPROTOCOL


GOOD = {"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]}
BAD_MESSAGES: list[tuple[Any, str]] = [
    (b"\xc1", "message"),
    (b"", "message"),
    (b"\x93\x01\x02", "message"),
    ("text", "message"),
    (wire.pack({}), "type"),
    (wire.pack({"type": "dance"}), "type"),
    (wire.pack(GOOD | {"v": 2}), "v"),
    (wire.pack(GOOD | {"subscriptions": []}), "subscriptions"),
    (wire.pack(GOOD | {"subscriptions": [{"product": 5}]}), "subscriptions[0].product"),
    (wire.pack(GOOD | {"subscriptions": [{"product": "magic"}]}), "product"),
    (wire.pack(GOOD | {"subscriptions": [{"product": "transient"}]}), "subscriptions[0].product"),
    (wire.pack(GOOD | {"subscriptions": [{"product": "range"}] * 2}), "subscriptions[1].product"),
    (wire.pack(GOOD | {"credits": 0}), "credits"),
    (wire.pack(GOOD | {"start": -1}), "start"),
]


@pytest.mark.parametrize(("message", "field"), BAD_MESSAGES)
def test_a_bad_first_message_is_answered_and_ends_the_stream(
    steady_stream: str, message: Any, field: str
) -> None:
    with streaming(steady_stream) as client:
        client.connection.send(message)
        problem = client.error()
        code = client.close_code()

    assert problem["field"] == field
    assert code == wire.CloseCode.BAD_FIRST_MESSAGE


def test_an_acknowledgement_is_no_first_message(steady_stream: str) -> None:
    with streaming(steady_stream) as client:
        client.send({"type": "ack", "frame": 1})

        assert client.error()["field"] == "type"


@pytest.mark.parametrize(("message", "field"), BAD_MESSAGES)
def test_a_bad_later_message_is_answered_and_the_stream_goes_on_as_it_was(
    steady_stream: str, message: Any, field: str
) -> None:
    with streaming(steady_stream) as client:
        client.subscribe("flags")
        client.connection.send(message)
        problem = client.error()
        frames = [client.frame() for _ in range(2)]

    assert problem["field"] == field
    assert {frame.product for frame in frames} == {"flags"}


def test_a_message_too_long_ends_that_stream_alone(served: Served) -> None:
    with streaming(served.stream_url) as other, streaming(served.stream_url) as client:
        other.subscribe("flags")
        client.connection.send(b"x" * (wire.MAX_CLIENT_MESSAGE_BYTES + 1))
        code = client.close_code()
        other.frame()

    assert code == wire.CloseCode.TOO_BIG


def test_a_client_that_never_subscribes_is_sent_away() -> None:
    with (
        serving("sim:mirrors?noise=off", stream={"first_message_s": 0.1}) as daemon,
        streaming(daemon.stream_url) as client,
    ):
        problem = client.error()
        code = client.close_code()

    assert problem["type"] == "/problems/first-message-late"
    assert code == wire.CloseCode.BAD_FIRST_MESSAGE


def test_one_client_too_many_is_told_to_try_again_later() -> None:
    with (
        serving("sim:mirrors?noise=off", stream={"max_clients": 1}) as daemon,
        streaming(daemon.stream_url) as first,
    ):
        first.subscribe("flags")
        with streaming(daemon.stream_url) as second:
            problem = second.error()
            code = second.close_code()
        first.frame()

    assert problem["type"] == "/problems/too-many-clients"
    assert code == wire.CloseCode.TRY_AGAIN_LATER


def test_a_client_that_leaves_is_forgotten(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        assert served.service.hub.clients == 1

    end_s = time.monotonic() + 10.0
    while served.service.hub.clients and time.monotonic() < end_s:
        time.sleep(0.01)
    assert served.service.hub.clients == 0


def test_a_client_is_told_when_the_service_shuts_down() -> None:
    with serving("sim:mirrors?noise=off") as daemon:
        context = streaming(daemon.stream_url)
        client = context.__enter__()
        client.subscribe("flags")
    code = client.close_code()
    context.__exit__(None, None, None)

    assert code == wire.CloseCode.GOING_AWAY
