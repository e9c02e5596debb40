"""The messages of docs/stream.md."""

import contextlib
import json
import math
import re
from typing import Any

import msgpack  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from hypothesis import given, strategies as st
from websockets.frames import CloseCode

from tests.client.conftest import SPECIFICATION, Recording
from transientcam import wire
from transientcam.errors import ProtocolError

_MESSAGES: dict[str, Any] = {
    "subscribe": wire.Subscribe(
        (wire.Subscription("range"), wire.Subscription("coefficients", 5.0)), credits=2
    ),
    "ack": wire.Ack(17),
    "hello": wire.Hello(
        session="5f0c",
        server={"name": "transientcam", "version": "0.1.0"},
        channels=(wire.Channel(0, "range", "m", ("y", "x"), "<f4", (2, 2)),),
        sequence={"harmonics": 3},
        camera={"state": "streaming"},
    ),
    "notice": wire.Notice("dropped", {"channel": 0, "count": 3, "total": 17}),
    "error": wire.ErrorMessage(
        {"type": "/problems/bad-message", "status": 422, "field": "v", "value": 2, "limit": "1"}
    ),
}


def _parse(name: str, data: bytes) -> object:
    from_client = name in ("subscribe", "ack")
    return wire.parse_client_message(data) if from_client else wire.parse_server_message(data)


@pytest.mark.parametrize("name", _MESSAGES)
def test_recorded_bytes_say_what_the_specification_prints_beside_them(
    name: str, recorded: dict[str, Recording]
) -> None:
    assert msgpack.unpackb(recorded[name].data) == recorded[name].document


@pytest.mark.parametrize("name", _MESSAGES)
def test_recorded_bytes_are_parsed(name: str, recorded: dict[str, Recording]) -> None:
    assert _parse(name, recorded[name].data) == _MESSAGES[name]


@pytest.mark.parametrize("name", _MESSAGES)
def test_messages_are_encoded_as_recorded(name: str, recorded: dict[str, Recording]) -> None:
    assert wire.encode(_MESSAGES[name]) == recorded[name].data


_RANGE_M = np.array([[1.5, math.nan], [2.25, -0.0]], dtype="<f4")


_FRAMES = ["frame", "u16", "reflection16"]


def _with_values(document: dict[str, Any]) -> dict[str, Any]:
    """Replace the bytes of arrays by numbers as JSON has them."""
    for array in (document["array"], document.get("brightness")):
        if array is not None:
            values = np.frombuffer(array["data"], array["dtype"]).tolist()
            array["data"] = ["NaN" if math.isnan(value) else value for value in values]
    return document | {"pad": document["pad"].decode()}


@pytest.mark.parametrize("name", _FRAMES)
def test_a_recorded_frame_says_what_the_specification_prints_beside_it(
    name: str, recorded: dict[str, Recording]
) -> None:
    said = _with_values(msgpack.unpackb(recorded[name].data))

    assert json.dumps(said) == json.dumps(recorded[name].document)  # -0.0 is not 0.0


@pytest.mark.parametrize("name", _FRAMES)
def test_the_data_of_a_recorded_frame_begins_at_a_multiple_of_8_bytes(
    name: str, recorded: dict[str, Recording]
) -> None:
    data = recorded[name].data

    assert (len(data) - len(msgpack.unpackb(data)["array"]["data"])) % 8 == 0


def test_a_recorded_frame_is_parsed(recorded: dict[str, Recording]) -> None:
    frame = wire.parse_server_message(recorded["frame"].data)

    assert isinstance(frame, wire.Frame)
    assert (frame.frame, frame.channel, frame.product, frame.unit) == (17, 0, "range", "m")
    assert (frame.axes, frame.encode_s, frame.extra) == (("y", "x"), 0.001, {})
    np.testing.assert_array_equal(frame.array, _RANGE_M)


def test_a_frame_that_was_not_encoded_took_no_time() -> None:
    data = wire.encode_frame(product="range", unit="m", axes=("y", "x"), meta={}, array=_RANGE_M)

    assert msgpack.unpackb(data)["encode_s"] == 0.0


def test_a_frame_is_encoded_as_recorded(recorded: dict[str, Recording]) -> None:
    data = wire.encode_frame(
        product="range",
        unit="m",
        axes=("y", "x"),
        meta={"frame": 17},
        array=_RANGE_M,
        encode_s=0.001,
        channel=0,
    )

    assert data == recorded["frame"].data


_CODED_RANGE_M = np.array([[1.0, math.nan], [1.99993896484375, 0.0]], dtype="<f4")
_COEFFICIENTS = np.array([[[3.0, math.nan]], [[-0.5, math.nan]], [[0.0, math.nan]]], dtype="<f4")


@pytest.mark.parametrize(
    ("name", "values"), [("u16", _CODED_RANGE_M), ("reflection16", _COEFFICIENTS)]
)
def test_a_recorded_frame_of_codes_is_parsed_into_values(
    name: str, values: Any, recorded: dict[str, Recording]
) -> None:
    frame = wire.parse_server_message(recorded[name].data)

    assert isinstance(frame, wire.Frame)
    np.testing.assert_allclose(frame.array, values, rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "coded"),
    [
        ("u16", wire.encode_u16(_CODED_RANGE_M)),
        ("reflection16", wire.encode_reflection16(_COEFFICIENTS)),
    ],
)
def test_values_are_encoded_as_recorded(
    name: str, coded: wire.Coded, recorded: dict[str, Recording]
) -> None:
    document = msgpack.unpackb(recorded[name].data)
    names = ("approximate", "max_error", "median_error", "encoding")

    data = wire.encode_frame(
        product=document["product"],
        unit=document["unit"],
        axes=tuple(document["axes"]),
        meta=document["meta"],
        array=coded.array,
        encode_s=document["encode_s"],
        channel=0,
        extra={key: document[key] for key in names if key in document} | coded.fields,
    )

    assert data == recorded[name].data


def test_a_frame_without_channel_keeps_what_only_its_product_has() -> None:
    data = wire.encode_frame(
        product="transient",
        unit="DN/s",
        axes=("time", "y", "x"),
        meta={"frame": 1},
        array=np.zeros((2, 1, 1), "<f4"),
        extra={"time_s": [0.0, 1e-9]},
    )

    frame = wire.parse_frame(data)

    assert frame.channel is None
    assert frame.time_s is not None
    np.testing.assert_array_equal(frame.time_s, [0.0, 1e-9])


@pytest.mark.parametrize("name", ["subscribe", "ack"])
def test_a_server_reads_no_long_message(name: str) -> None:
    data = wire.pack({**_MESSAGES[name].to_document(), "more": "x" * 65536})

    with pytest.raises(ProtocolError, match="must be at most 65536 bytes"):
        wire.parse_client_message(data)


def test_unknown_keys_are_passed_over() -> None:
    for name, message in _MESSAGES.items():
        if name not in ("notice", "error"):
            data = wire.pack({**message.to_document(), "of-a-later-version": [1]})
            assert _parse(name, data) == message


def test_left_out_options_of_a_subscription_mean_nil() -> None:
    data = wire.pack({"type": "subscribe", "v": 1, "subscriptions": [{"product": "range"}]})

    assert wire.parse_client_message(data) == wire.Subscribe((wire.Subscription("range"),))


def test_a_token_is_not_shown() -> None:
    assert "secret" not in repr(wire.Subscribe((wire.Subscription("range"),), token="secret"))


_SUBSCRIBE = _MESSAGES["subscribe"].to_document()
_HELLO = _MESSAGES["hello"].to_document()
_CHANNEL = _HELLO["channels"][0]
_FRAME: dict[str, Any] = {
    "v": 1,
    "type": "frame",
    "product": "range",
    "unit": "m",
    "axes": ["y", "x"],
    "meta": {"frame": 1},
    "encode_s": 0.0,
    "array": {"dtype": "|u1", "shape": [1, 1], "data": b"\0"},
}


@pytest.mark.parametrize("frame", [0, 2**53 - 1])
def test_a_frame_may_have_any_number_that_a_browser_counts_exactly(frame: int) -> None:
    assert wire.parse_client_message(wire.encode(wire.Ack(frame))) == wire.Ack(frame)


@pytest.mark.parametrize(
    "change",
    [
        {"subscriptions": [{"product": "range"}] * 16},
        {"subscriptions": [{"product": "x" * 64}]},
        {"subscriptions": [{"product": "range", "max_rate_hz": 5e-324}]},
        {"subscriptions": [{"product": "range", "decimation": 1}]},
        {"subscriptions": [{"product": "range", "decimation": 64}]},
        {"subscriptions": [{"product": "range", "region": [0, 0, 1, 2**31 - 1]}]},
        {"token": "x" * 4096},
        {"credits": 1},
        {"credits": 64},
        {"start": 1},
        {"start": 2**53 - 1},
    ],
)
def test_the_limits_of_a_subscription_are_part_of_it(change: dict[str, Any]) -> None:
    document = _SUBSCRIBE | change

    parsed = wire.parse_client_message(wire.pack(document))

    assert isinstance(parsed, wire.Subscribe)
    assert parsed.credits == document["credits"]
    assert parsed.start == document["start"]
    assert parsed.token == document["token"]
    assert [
        (each.product, each.max_rate_hz, each.region and list(each.region), each.decimation)
        for each in parsed.subscriptions
    ] == [
        (each["product"], each.get("max_rate_hz"), each.get("region"), each.get("decimation", 1))
        for each in document["subscriptions"]
    ]


def test_messages_up_to_the_longest_are_read() -> None:
    message = {"type": "ack", "frame": 1, "more": ""}
    longest = wire.pack(message | {"more": "x" * (65536 - len(wire.pack(message)) - 2)})
    assert len(longest) == 65536

    assert wire.parse_client_message(longest) == wire.Ack(1)
    with pytest.raises(ProtocolError, match="65537 bytes', but must be at most 65536 bytes"):
        wire.parse_client_message(longest + b"x")
    with pytest.raises(ProtocolError, match="65536 bytes', but must be at most 65535 bytes"):
        wire.parse_server_message(longest, max_bytes=65535)


def test_a_client_reads_a_frame_of_640_x_480_at_32_harmonics_and_not_what_fills_its_memory() -> (
    None
):
    largest_bytes = 65 * 640 * 480 * 4

    assert largest_bytes < wire.MAX_SERVER_MESSAGE_BYTES < 2**30


def test_a_frame_that_states_no_time_of_encoding_took_none() -> None:
    document = wire.frame_document(product="range", unit="m", axes=("x",), meta={"frame": 1})

    assert document["encode_s"] == 0.0


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"type": None}, "type"),
        ({"type": "unsubscribe"}, "type"),
        ({"v": 2}, "v"),
        ({"v": None}, "v"),
        ({"subscriptions": None}, "subscriptions"),
        ({"subscriptions": []}, "subscriptions"),
        ({"subscriptions": [{"product": "range"}] * 17}, "subscriptions"),
        ({"subscriptions": ["range"]}, "subscriptions[0]"),
        ({"subscriptions": [{}]}, "subscriptions[0].product"),
        ({"subscriptions": [{"product": 3}]}, "subscriptions[0].product"),
        ({"subscriptions": [{"product": "x" * 65}]}, "subscriptions[0].product"),
        (
            {"subscriptions": [{"product": "range"}, {"product": "raw", "max_rate_hz": 0}]},
            "subscriptions[1].max_rate_hz",
        ),
        (
            {"subscriptions": [{"product": "range", "max_rate_hz": math.nan}]},
            "subscriptions[0].max_rate_hz",
        ),
        (
            {"subscriptions": [{"product": "range", "max_rate_hz": math.inf}]},
            "subscriptions[0].max_rate_hz",
        ),
        (
            {"subscriptions": [{"product": "range", "max_rate_hz": True}]},
            "subscriptions[0].max_rate_hz",
        ),
        ({"subscriptions": [{"product": "range", "decimation": 0}]}, "subscriptions[0].decimation"),
        (
            {"subscriptions": [{"product": "range", "decimation": 65}]},
            "subscriptions[0].decimation",
        ),
        (
            {"subscriptions": [{"product": "range", "region": [0, 0, 8, 2**31]}]},
            "subscriptions[0].region[3]",
        ),
        (
            {"subscriptions": [{"product": "range", "region": [-1, 0, 8, 8]}]},
            "subscriptions[0].region[0]",
        ),
        ({"subscriptions": [{"product": "range", "region": [0, 0, 8]}]}, "subscriptions[0].region"),
        (
            {"subscriptions": [{"product": "range", "region": [0, 0, 8, 8, 8]}]},
            "subscriptions[0].region",
        ),
        ({"token": 5}, "token"),
        ({"token": "x" * 4097}, "token"),
        ({"type": "x" * 257}, "type"),
        ({"credits": 0}, "credits"),
        ({"credits": 65}, "credits"),
        ({"credits": 2.0}, "credits"),
        ({"credits": True}, "credits"),
        ({"start": 0}, "start"),
        ({"start": 2**53}, "start"),
    ],
)
def test_a_bad_subscription_is_refused_by_name(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        wire.parse_client_message(wire.pack(_SUBSCRIBE | change))

    assert caught.value.field == field


@pytest.mark.parametrize("number", [None, -1, 2**53, 1.0, "1", True])
def test_a_bad_acknowledgement_is_refused(number: object) -> None:
    with pytest.raises(ProtocolError, match="frame is"):
        wire.parse_client_message(wire.pack({"type": "ack", "frame": number}))


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({}, "type"),
        ({"type": "farewell"}, "type"),
        (_HELLO | {"v": 2}, "v"),
        (_HELLO | {"session": 1}, "session"),
        (_HELLO | {"sequence": []}, "sequence"),
        (_HELLO | {"channels": {}}, "channels"),
        (_HELLO | {"channels": [_CHANNEL] * 65}, "channels"),
        (_HELLO | {"channels": [None]}, "channels[0]"),
        (_HELLO | {"channels": [_CHANNEL | {"dtype": "O"}]}, "channels[0].dtype"),
        (_HELLO | {"channels": [_CHANNEL | {"shape": [-1]}]}, "channels[0].shape[0]"),
        (_HELLO | {"channels": [_CHANNEL | {"axes": [1]}]}, "channels[0].axes[0]"),
        (_FRAME | {"v": 0}, "v"),
        (_FRAME | {"meta": None}, "meta"),
        (_FRAME | {"meta": {}}, "meta.frame"),
        (_FRAME | {"axes": ["x"]}, "array.shape"),
        (_FRAME | {"array": b"\0"}, "array"),
        (_FRAME | {"encode_s": "fast"}, "encode_s"),
        (_FRAME | {"channel": -1}, "channel"),
        (_FRAME | {"channel": 2**53}, "channel"),
        (_FRAME | {"meta": {"frame": -1}}, "meta.frame"),
        (_FRAME | {"meta": {"frame": 2**53}}, "meta.frame"),
        (_FRAME | {"axes": ["x"] * 7}, "axes"),
        (_FRAME | {"product": "x" * 257}, "product"),
        (_HELLO | {"channels": [_CHANNEL | {"channel": -1}]}, "channels[0].channel"),
        (_HELLO | {"channels": [_CHANNEL | {"channel": 2**53}]}, "channels[0].channel"),
        (_HELLO | {"channels": [_CHANNEL | {"shape": [1] * 7}]}, "channels[0].shape"),
        (_HELLO | {"channels": [_CHANNEL | {"shape": [2**31]}]}, "channels[0].shape[0]"),
        (_HELLO | {"channels": [_CHANNEL | {"axes": ["x"] * 7}]}, "channels[0].axes"),
        (_HELLO | {"channels": [_CHANNEL | {"decimation": 0}]}, "channels[0].decimation"),
        (_HELLO | {"channels": [_CHANNEL | {"decimation": 65}]}, "channels[0].decimation"),
        ({"type": "notice"}, "kind"),
        ({"type": "error"}, "problem"),
    ],
)
def test_a_bad_message_of_a_server_is_refused_by_name(document: dict[str, Any], field: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        wire.parse_server_message(wire.pack(document))

    assert caught.value.field == field


@pytest.mark.parametrize(
    "change",
    [
        {"channel": 0},
        {"channel": 2**53 - 1},
        {"product": "x" * 256},
        {"axes": ["x"] * 6, "shape": [2**31 - 1] * 6},
        {"shape": [0]},
        {"decimation": 1},
        {"decimation": 64},
        {"region": [0, 0, 2**31 - 1, 1]},
    ],
)
def test_the_limits_of_a_channel_are_part_of_it(change: dict[str, Any]) -> None:
    channel = _CHANNEL | {"encoding": "f32"} | change

    parsed = wire.parse_server_message(wire.pack(_HELLO | {"channels": [channel] * 64}))

    assert isinstance(parsed, wire.Hello)
    assert len(parsed.channels) == 64
    assert parsed.channels[63].to_document() == {
        key: value for key, value in channel.items() if (key, value) != ("decimation", 1)
    }


@pytest.mark.parametrize(
    "change",
    [
        {"channel": 0},
        {"channel": 2**53 - 1},
        {"channel": None},
        {"meta": {"frame": 0}},
        {"meta": {"frame": 2**53 - 1}},
        {"axes": ["x"] * 6, "array": {"dtype": "|u1", "shape": [1] * 6, "data": b"\0"}},
    ],
)
def test_the_limits_of_a_frame_are_part_of_it(change: dict[str, Any]) -> None:
    document = _FRAME | change

    parsed = wire.parse_server_message(wire.pack(document))

    assert isinstance(parsed, wire.Frame)
    assert parsed.channel == document.get("channel")
    assert parsed.frame == document["meta"]["frame"]
    assert list(parsed.axes) == document["axes"]


def test_a_message_that_is_no_frame_is_no_frame() -> None:
    with pytest.raises(ProtocolError, match="type is 'notice', but must be frame"):
        wire.parse_frame(wire.encode(_MESSAGES["notice"]))


_ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 2**60) | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


def _mutations(document: dict[str, Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Return ``document`` with some value, at any depth, replaced by anything."""

    def paths(value: object, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        match value:
            case dict():
                return [path, *(p for k, v in value.items() for p in paths(v, (*path, k)))]
            case list():
                return [path, *(p for i, v in enumerate(value) for p in paths(v, (*path, i)))]
            case _:
                return [path]

    def replaced(value: Any, path: tuple[Any, ...], new: object) -> Any:
        if not path:
            return new
        copy = value.copy()
        copy[path[0]] = replaced(value[path[0]], path[1:], new)
        return copy

    places = [path for path in paths(document) if path]
    return st.builds(
        lambda path, new: replaced(document, path, new), st.sampled_from(places), _ANYTHING
    )


@given(
    document=st.one_of(*map(_mutations, [_SUBSCRIBE, _HELLO, _FRAME, {"type": "ack", "frame": 1}]))
)
def test_no_message_of_any_content_raises_anything_but_one_kind_of_error(
    document: dict[str, Any],
) -> None:
    data = msgpack.packb(document)
    for parse in (wire.parse_client_message, wire.parse_server_message, wire.parse_frame):
        with contextlib.suppress(ProtocolError):
            parse(data)


def test_every_product_is_in_the_specification_as_it_is_in_the_code() -> None:
    text = SPECIFICATION.read_text("utf-8").replace("\\|", "|")

    for product in wire.PRODUCTS.values():
        axes = ", ".join(product.axes)
        row = (f"`{product.name}`", axes, f"`{product.dtype}`", product.unit, product.summary)
        assert f"| {' | '.join(row)} |" in text


def test_limits_are_those_of_the_specification() -> None:
    text = " ".join(SPECIFICATION.read_text("utf-8").split())

    assert f"The first message, within {wire.FIRST_MESSAGE_WITHIN_S:g} s" in text
    assert f"reads no message longer than {wire.MAX_CLIENT_MESSAGE_BYTES / 1024:g} KiB" in text
    assert f"1 to {wire.MAX_SUBSCRIPTIONS} maps" in text
    assert f"integer from 1 to {wire.MAX_CREDITS}: how many frames" in text
    assert f"integer from 1 to {wire.MAX_DECIMATION}: only every so many pixels" in text


@pytest.mark.parametrize(
    ("ours", "name"),
    [
        (wire.CloseCode.NORMAL, "NORMAL_CLOSURE"),
        (wire.CloseCode.GOING_AWAY, "GOING_AWAY"),
        (wire.CloseCode.ABNORMAL, "ABNORMAL_CLOSURE"),
        (wire.CloseCode.POLICY, "POLICY_VIOLATION"),
        (wire.CloseCode.TOO_BIG, "MESSAGE_TOO_BIG"),
        (wire.CloseCode.INTERNAL_ERROR, "INTERNAL_ERROR"),
        (wire.CloseCode.TRY_AGAIN_LATER, "TRY_AGAIN_LATER"),
    ],
)
def test_codes_of_rfc_6455_are_those_of_another_library(ours: wire.CloseCode, name: str) -> None:
    assert int(ours) == int(CloseCode[name])


def test_every_close_code_is_in_the_specification() -> None:
    text = SPECIFICATION.read_text("utf-8")

    never_sent = {wire.CloseCode.ABNORMAL, wire.CloseCode.INTERNAL_ERROR}
    for code in set(wire.CloseCode) - never_sent:
        assert f"| {code} |" in text


def test_the_codes_of_trust_are_those_of_the_specification() -> None:
    text = SPECIFICATION.read_text("utf-8").partition("The codes of `trust`;")[2]
    codes = re.findall(r"^\| (\d+) \| `(\w+)` \|", text.partition("\n\n`")[0], re.MULTILINE)

    assert [(int(code), name) for code, name in codes] == [
        (trust.value, name.lower()) for name, trust in wire.Trust.__members__.items()
    ]


def test_every_kind_of_notice_is_in_the_specification_with_its_keys() -> None:
    text = SPECIFICATION.read_text("utf-8")

    for kind in wire.NOTICES.values():
        keys = ", ".join(f"`{key}`" for key in kind.keys)
        assert f"| `{kind.name}` | {keys} |".replace("|  |", "| |") in text
    table = text.partition("### notice")[2].partition("```")[0]
    assert table.count("\n| `") == len(wire.NOTICES)
