from contextlib import suppress
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.server.streaming import VIDEO, Client, streaming
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import density, wire
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
    with streaming(served.stream_url) as client, httpx.Client(base_url=served.url) as http:
        client.subscribe("range")
        frame = client.frame()
        http.put("/api/v1/acquisition", json={"running": False})
        rest = wire.parse_frame(http.get("/api/v1/frames/latest/range").content)
        while frame.meta["frame"] < rest.meta["frame"]:
            frame = client.frame()

    np.testing.assert_array_equal(frame.array, rest.array)


def test_data_starts_at_a_multiple_of_eight_bytes(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("coefficients")
        data = client.connection.recv(timeout=60.0)

    assert isinstance(data, bytes)
    size = wire.parse_frame(data).array.nbytes
    assert (len(data) - size) % wire.ALIGNMENT == 0


def test_a_rate_limit_thins_one_channel_and_leaves_the_other(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.send(
            {
                "type": "subscribe",
                "v": 1,
                "subscriptions": [{"product": "flags"}, {"product": "range", "max_rate_hz": 2.0}],
            }
        )
        times_s: dict[str, list[float]] = {"flags": [], "range": []}
        # however many frames a laden machine captures, some are sent without a range
        while len(times_s["range"]) < 3 or len(times_s["flags"]) < len(times_s["range"]) + 3:
            frame = client.frame()
            times_s[frame.product].append(frame.meta["device_time_s"])

    assert set(times_s["range"]) <= set(times_s["flags"])
    # a frame is due a tenth of the period early
    since_s = np.subtract(times_s["range"], times_s["range"][0])
    assert (since_s > (np.arange(len(since_s)) - 0.11) / 2.0).all()


def test_a_new_subscription_replaces_the_old_one(served: Served) -> None:
    with streaming(served.stream_url) as client:
        first = client.subscribe("range")
        client.frame()
        second = client.subscribe("direct")

        assert first.session == second.session
        # a frame of the old one may have been on its way
        products = [client.frame().product for _ in range(3)]
        assert products[-2:] == ["direct", "direct"]


def receives_a_frame(client: Client, *, within_s: float) -> bool:
    """Whether a frame comes; notices may, as of lost images on a laden machine."""
    try:
        while not isinstance(client.receive(timeout_s=within_s), wire.Frame):
            pass
    except TimeoutError:
        return False
    return True


def test_with_credits_the_server_waits_for_the_client_and_then_sends_the_newest(
    served: Served, http: httpx.Client
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("range", credits=1)
        first = client.frame()
        http.get("/api/v1/frames/latest", params={"wait_s": 10.0, "after": first.frame + 3})
        assert not receives_a_frame(client, within_s=0.1)
        waited_for = served.service.hub.latest
        assert waited_for is not None

        client.send({"type": "ack", "frame": first.meta["frame"]})
        dropped = client.notice("dropped")
        second = client.frame()

    assert second.meta["frame"] >= waited_for.number
    skipped = second.meta["frame"] - first.meta["frame"] - 1
    counts = dict(dropped.details)
    # after the acknowledgement one more may be left out before the next is on its way
    assert 1 <= counts.pop("unacknowledged") <= skipped
    assert counts == {"channel": first.channel, "count": skipped, "total": skipped}


def test_a_start_in_the_past_sends_every_frame_from_there_and_goes_on_with_the_newest(
    served: Served,
) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        while client.frame().meta["frame"] < 6:
            pass
        client.subscribe("flags", start=2)
        messages = [client.receive() for _ in range(12)]

    numbers = [each.meta["frame"] for each in messages if isinstance(each, wire.Frame)]
    dropped = sum(  # of the newest, where the machine is busy
        each.details["count"]
        for each in messages
        if isinstance(each, wire.Notice) and each.kind == "dropped"
    )
    assert numbers[:5] == [2, 3, 4, 5, 6]
    assert len(numbers) + dropped == numbers[-1] - 1


def test_with_credits_frames_of_the_past_wait_for_them_too(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        while client.frame().meta["frame"] < 6:
            pass
        client.subscribe("flags", start=1, credits=1)
        numbers = []
        for _ in range(4):
            frame = client.frame()
            numbers.append(frame.meta["frame"])
            client.send({"type": "ack", "frame": frame.meta["frame"]})

    assert numbers == [1, 2, 3, 4]


def test_what_is_kept_no_more_is_reported_as_a_gap() -> None:
    with (
        serving("sim:mirrors?noise=off", history={"seconds": 0.3}) as daemon,
        streaming(daemon.stream_url) as client,
    ):
        client.subscribe("flags")
        while client.frame().meta["frame"] < 12:
            pass
        client.subscribe("flags", start=2)
        gaps: list[wire.Notice] = []
        while not isinstance(message := client.receive(), wire.Frame):
            gaps += [message] if isinstance(message, wire.Notice) and message.kind == "gap" else []

    missing = 2  # once more where the next one went between the notice and its turn
    for gap in gaps:
        assert gap.details["from"] == missing
        assert gap.details["reason"] == "not kept any more"
        missing = gap.details["to"] + 1
    assert 2 < missing == message.meta["frame"]


def test_no_client_waits_for_a_start_that_is_not_captured_yet(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        latest = client.frame().meta["frame"]
        client.subscribe("flags", start=latest + 1_000_000)
        gap = client.notice("gap")
        frame = client.frame()

    assert gap.details["to"] == latest + 1_000_000 - 1
    assert latest < gap.details["from"] <= frame.meta["frame"]  # more may be dropped
    assert gap.details["reason"] == "not captured yet"


def test_a_region_and_a_decimation_send_the_pixels_that_rest_answers(served: Served) -> None:
    region = [40, 30, 50, 21]
    with streaming(served.stream_url) as client, httpx.Client(base_url=served.url) as http:
        hello = client.subscribe({"product": "moments", "region": region, "decimation": 2})
        frame = client.frame()
        http.put("/api/v1/acquisition", json={"running": False})
        whole = wire.parse_frame(http.get("/api/v1/frames/latest/moments").content)
        while frame.meta["frame"] < whole.meta["frame"]:
            frame = client.frame()

    (channel,) = hello.channels
    assert (channel.region, channel.decimation) == (tuple(region), 2)
    assert channel.shape == frame.array.shape == (4, 11, 25)
    assert (frame.meta["region"], frame.meta["decimation"]) == (region, 2)
    np.testing.assert_array_equal(frame.array, whole.array[:, 30:51:2, 40:90:2])


def test_a_frame_that_one_pixel_was_streamed_of_can_be_requested_until_it_is_acknowledged() -> None:
    with (
        serving("sim:mirrors?noise=off", history={"seconds": 0.0}) as daemon,
        streaming(daemon.stream_url) as client,
        httpx.Client(base_url=f"{daemon.url}/api/v1/frames") as http,
    ):
        client.subscribe({"product": "range", "region": [0, 0, 1, 1]}, credits=1)
        pixel = client.frame()
        http.get("/latest", params={"wait_s": 10.0, "after": pixel.frame + 1})
        held = daemon.service.hub.partly_sent(pixel.frame)
        whole = wire.parse_frame(http.get(f"/{pixel.frame}/range").content)
        client.send({"type": "ack", "frame": pixel.frame})
        client.frame()
        gone = http.get(f"/{pixel.frame}/range")

    assert held is not None
    assert not held.past  # computed once, for stream and request
    assert whole.frame == pixel.frame
    np.testing.assert_array_equal(whole.array[:1, :1], pixel.array)
    assert gone.status_code == 410


def test_thin_encodings_arrive_as_the_same_arrays_within_their_error(served: Served) -> None:
    with streaming(served.stream_url) as client:
        hello = client.subscribe(
            "range",
            {"product": "range", "encoding": "u16"},
            "coefficients",
            {"product": "coefficients", "encoding": "reflection16"},
        )
        exact_m, steps_m, exact, thin = (client.frame() for _ in range(4))

    assert [channel.encoding for channel in hello.channels] == ["f32", "u16", "f32", "reflection16"]
    assert [channel.dtype for channel in hello.channels] == ["<f4", "<u2", "<f4", "<u2"]
    assert [channel.shape[0] for channel in hello.channels] == [120, 120, 7, 6]
    assert exact_m.frame == steps_m.frame == exact.frame == thin.frame
    step_m = steps_m.extra["scale"]
    np.testing.assert_array_equal(np.isnan(steps_m.array), np.isnan(exact_m.array))
    assert np.nanmax(np.abs(steps_m.array - exact_m.array)) <= 0.51 * step_m
    phase_rad = np.linspace(0.0, 2.0 * np.pi, 200)
    densities = [density(each.array.astype(np.float64), phase_rad) for each in (exact, thin)]
    error = np.abs(densities[1] - densities[0]).max(axis=0) / densities[0].max(axis=0)
    assert thin.extra["approximate"] is True
    # what the message says of itself was measured on some of the pixels, at some other phases
    assert 0.5 < np.median(error) / thin.extra["median_error"] < 2.0
    assert thin.extra["median_error"] < thin.extra["max_error"] < 2.0 * error.max()


def test_clients_with_the_same_subscription_share_a_channel_number_and_others_do_not(
    served: Served,
) -> None:
    with streaming(served.stream_url) as one, streaming(served.stream_url) as other:
        first = one.subscribe("range", {"product": "range", "decimation": 2})
        second = other.subscribe({"product": "range", "decimation": 2}, "direct", "range")

    whole, coarse = (each.channel for each in first.channels)
    assert [each.channel for each in second.channels][::2] == [coarse, whole]
    assert len({each.channel for each in (*first.channels, *second.channels)}) == 3


def test_a_client_that_sends_without_end_is_closed_and_no_other(served: Served) -> None:
    with streaming(served.stream_url) as other, streaming(served.stream_url) as client:
        other.subscribe("flags")
        client.subscribe("flags", max_rate_hz=0.5)
        with suppress(ConnectionClosed):
            for _ in range(10_000):
                client.send({"type": "ack", "frame": 1})
        problem = client.error()
        code = client.close_code()
        other.frame()

    assert problem["type"] == "/problems/too-many-messages"
    assert code == wire.CloseCode.TOO_MANY_MESSAGES


def test_there_may_be_fewer_subscriptions_than_the_protocol_allows() -> None:
    with (
        serving("sim:mirrors?noise=off", stream={"max_subscriptions": 2}) as daemon,
        streaming(daemon.stream_url) as client,
    ):
        client.subscribe("flags", "range")
        client.send(GOOD | {"subscriptions": [{"product": n} for n in ("range", "flags", "raw")]})
        problem = client.error()
        client.frame()

    assert (problem["field"], problem["value"]) == ("subscriptions", 3)


def test_a_changed_sequence_is_reported_before_its_first_frame(served: Served) -> None:
    with streaming(served.stream_url) as client:
        client.subscribe("moments")
        client.frame()
        applied = served.service.acquisition.configure(Sequence(harmonics=4)).result(60.0)
        notice = client.notice("sequence-changed")
        frame = client.frame()
        while frame.meta["sequence_id"] != applied.epoch:
            frame = client.frame()

    assert notice.details["sequence"] == applied.to_document()
    (channel,) = wire.parse_channels(notice.details)
    assert channel.shape == frame.array.shape == (5, 120, 163)


def test_frames_come_at_the_rate_of_the_camera_and_every_missing_one_is_reported(
    served: Served,
) -> None:
    served.service.acquisition.configure(Sequence.from_document(VIDEO)).result(60.0)
    with streaming(served.stream_url) as client:
        client.subscribe("flags")
        messages = [client.receive() for _ in range(25)]

    places = [place for place, each in enumerate(messages) if isinstance(each, wire.Frame)]
    between = messages[places[0] : places[-1] + 1]  # a notice is sent before the frame behind a gap
    frames = [message for message in between if isinstance(message, wire.Frame)]
    dropped = sum(
        message.details["count"]
        for message in between
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
    with pytest.raises(InvalidStatus) as caught, streaming(served.stream_url, subprotocols=offered):
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
    (
        wire.pack(GOOD | {"subscriptions": [{"product": "flags", "encoding": "u16"}]}),
        "subscriptions[0].encoding",
    ),
    (
        wire.pack(GOOD | {"subscriptions": [{"product": "range", "encoding": "f16"}]}),
        "subscriptions[0].encoding",
    ),
    (
        wire.pack(GOOD | {"subscriptions": [{"product": "range", "region": [0, 0, 164, 1]}]}),
        "subscriptions[0].region",
    ),
    (
        wire.pack(GOOD | {"subscriptions": [{"product": "range", "region": [0, 0, 1]}]}),
        "subscriptions[0].region",
    ),
    (
        wire.pack(GOOD | {"subscriptions": [{"product": "range", "decimation": 0}]}),
        "subscriptions[0].decimation",
    ),
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


def test_one_client_too_many_is_asked_to_try_again_later() -> None:
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

    wait_until(lambda: not served.service.hub.clients)


def test_a_client_is_notified_when_the_service_shuts_down() -> None:
    with serving("sim:mirrors?noise=off") as daemon:
        context = streaming(daemon.stream_url)
        client = context.__enter__()
        client.subscribe("flags")
    code = client.close_code()
    context.__exit__(None, None, None)

    assert code == wire.CloseCode.GOING_AWAY
