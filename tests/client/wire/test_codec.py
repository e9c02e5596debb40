"""Maps as bytes."""

import contextlib
from typing import Any

import msgpack  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from hypothesis import given, strategies as st

from transientcam.errors import ProtocolError
from transientcam.wire import ALIGNMENT, pack, unpack
from transientcam.wire._codec import pack_with_array

_PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False)
    | st.text(max_size=20)
    | st.binary(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=12,
)
_MAPS = st.dictionaries(st.text(max_size=8), _PLAIN, max_size=6)


@given(document=_MAPS)
def test_a_map_arrives_as_it_was(document: dict[str, Any]) -> None:
    assert unpack(pack(document), max_bytes=2**20) == document


@given(
    document=_MAPS.filter(lambda each: not {"pad", "array"} & set(each)), length=st.integers(0, 70)
)
def test_an_array_is_last_and_its_data_aligned_whatever_stands_before(
    document: dict[str, Any], length: int
) -> None:
    array = np.arange(length, dtype="|u1")

    message = pack_with_array(document, array)

    assert (len(message) - length) % ALIGNMENT == 0
    assert message.endswith(array.tobytes())
    read = msgpack.unpackb(message)
    assert list(read)[-2:] == ["pad", "array"]
    assert read.pop("array") == {"dtype": "|u1", "shape": [length], "data": array.tobytes()}
    assert set(read.pop("pad")) <= {0}
    assert read == document


@given(data=st.binary(max_size=200))
def test_random_bytes_are_a_map_or_one_kind_of_error(data: bytes) -> None:
    try:
        document = unpack(data, max_bytes=150)
    except ProtocolError:
        return
    assert isinstance(document, dict)


@given(document=_MAPS, data=st.data())
def test_damaged_messages_are_a_map_or_one_kind_of_error(
    document: dict[str, Any], data: st.DataObject
) -> None:
    message = bytearray(pack(document))
    for _ in range(data.draw(st.integers(1, 4))):
        message[data.draw(st.integers(0, len(message) - 1))] = data.draw(st.integers(0, 255))
    del message[data.draw(st.integers(1, len(message))) :]
    with contextlib.suppress(ProtocolError):
        unpack(bytes(message), max_bytes=2**20)


@pytest.mark.parametrize(
    ("data", "field", "value"),
    [
        (b"", "message", "no msgpack"),
        (b"\xc1", "message", "no msgpack"),
        (b"\x80\x80", "message", "no msgpack"),  # two values
        (b"\x91" * 3000, "message", "no msgpack"),  # deeper than any stack
        (b"\x81\xa1k" * 3000, "message", "no msgpack"),
        (b"\xdf\xff\xff\xff\xff", "message", "no msgpack"),  # a map of 4 billion entries
        (b"\xc6\xff\xff\xff\xff", "message", "no msgpack"),
        (b"\x81\xa1k\xd9\x01\xff", "message", "no msgpack"),  # a string that is no UTF-8
        (b"\x81\x91\x01\x02", "message", "no msgpack"),  # a list as key
        (b"\x81\x01\x02", "message", "no msgpack"),  # a number as key
        (b"\x81\xc4\x01k\x02", "key", "k"),  # binary as key
        (b"\x81\xa1k\x81\xc4\x01k\x02", "key", "k"),  # the same, further in
        (b"\x81\xa1k\xd4\x05\x00", "message", "extension type"),
        (b"\x93\x01\x02\x03", "message", "[1, 2, 3]"),
        (b"\xc0", "message", "None"),
        ("{}", "message", "text"),
        (bytes(1001), "message", "1001 bytes"),
    ],
)
def test_what_is_no_map_is_refused_by_name(data: bytes | str, field: str, value: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        unpack(data, max_bytes=10_000 if len(data) != 1001 else 1000)

    assert caught.value.field == field
    assert value in str(caught.value)
    assert len(str(caught.value)) < 200


def test_a_message_may_be_as_long_as_allowed() -> None:
    data = pack({"k": "x" * 50})

    assert unpack(data, max_bytes=len(data)) == {"k": "x" * 50}
    with pytest.raises(ProtocolError, match=f"{len(data)} bytes"):
        unpack(data, max_bytes=len(data) - 1)
