"""Arrays as plain maps."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as npst
from numpy.typing import NDArray

from transientcam.errors import ParameterError, ProtocolError
from transientcam.wire import DTYPES, array_document, parse_array

_SHAPES = npst.array_shapes(min_dims=0, max_dims=6, min_side=0, max_side=4)
_ARRAYS = st.sampled_from(sorted(DTYPES)).flatmap(
    lambda dtype: npst.arrays(np.dtype(dtype), _SHAPES)
)


def _travel(array: NDArray[Any]) -> NDArray[Any]:
    document = array_document(array)
    return parse_array({**document, "data": bytes(document["data"])})


@given(array=_ARRAYS)
def test_an_array_arrives_bit_for_bit(array: NDArray[Any]) -> None:
    arrived = _travel(array)

    assert arrived.dtype == array.dtype
    assert arrived.shape == array.shape
    assert arrived.tobytes() == array.tobytes()


def test_the_document_is_what_the_specification_says() -> None:
    document = array_document(np.array([[1, 256]], dtype="<u2"))

    assert {**document, "data": bytes(document["data"])} == {
        "dtype": "<u2",
        "shape": [1, 2],
        "data": b"\x01\x00\x00\x01",
    }
    assert list(document) == ["dtype", "shape", "data"]


def test_big_endian_and_strided_arrays_arrive_little_endian_and_contiguous() -> None:
    array = np.arange(24, dtype=">f4").reshape(4, 6)[::-2, 1::2]

    arrived = _travel(array)

    assert arrived.dtype.str == "<f4"
    np.testing.assert_array_equal(arrived, array)


def test_no_copy_is_made_of_an_array_that_can_travel_as_it_is() -> None:
    array = np.zeros((3, 4), dtype="<f4")

    view = array_document(array)["data"]

    assert np.shares_memory(np.frombuffer(view, np.uint8), array)


def test_a_parsed_array_is_a_read_only_view_of_its_bytes() -> None:
    data = np.arange(6, dtype="<f4").tobytes()

    array = parse_array({"dtype": "<f4", "shape": [2, 3], "data": data})

    assert np.shares_memory(array, np.frombuffer(data, np.uint8))
    assert not array.flags.writeable


@pytest.mark.parametrize("dtype", ["O", "<i4", "<f2", "<c16", "S3", "<M8[s]", "?", "V4"])
def test_a_dtype_that_does_not_travel_is_refused_at_both_ends(dtype: str) -> None:
    with pytest.raises(ParameterError, match="dtype is"):
        array_document(np.zeros(2, dtype=dtype))
    with pytest.raises(ProtocolError, match=r"array\.dtype is .* one of <f4, "):
        parse_array({"dtype": dtype, "shape": [0], "data": b""})


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({}, "array.dtype"),
        ({"dtype": 4, "shape": [1], "data": b"\0"}, "array.dtype"),
        ({"dtype": "|u1", "shape": 1, "data": b"\0"}, "array.shape"),
        ({"dtype": "|u1", "shape": [-1, -1], "data": b"\0"}, "array.shape[0]"),
        ({"dtype": "|u1", "shape": [True], "data": b"\0"}, "array.shape[0]"),
        ({"dtype": "|u1", "shape": [1.0], "data": b"\0"}, "array.shape[0]"),
        ({"dtype": "|u1", "shape": [2**31], "data": b"\0"}, "array.shape[0]"),
        ({"dtype": "|u1", "shape": [1] * 7, "data": b"\0"}, "array.shape"),
        ({"dtype": "|u1", "shape": [1], "data": "\0"}, "array.data"),
        ({"dtype": "|u1", "shape": [1]}, "array.data"),
        ({"dtype": "|u1", "shape": [2], "data": b"\0"}, "array.data"),
        ({"dtype": "<f4", "shape": [2**31 - 1] * 6, "data": b"\0"}, "array.data"),
        ({"dtype": "<f4", "shape": [], "data": b"\0\0\0\0\0"}, "array.data"),
    ],
)
def test_a_map_that_is_no_array_is_refused_by_name(document: dict[str, object], field: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        parse_array(document)

    assert caught.value.field == field


def test_more_axes_than_can_travel_are_refused() -> None:
    with pytest.raises(ParameterError, match="dimensions is 7"):
        array_document(np.zeros((1,) * 7, dtype="<f4"))


def test_as_many_bytes_as_msgpack_can_hold_are_taken(tmp_path: Path) -> None:
    most = 2**32 - 1
    array = np.memmap(tmp_path / "sparse", np.uint8, "w+", shape=most)  # takes no memory

    assert array_document(array)["data"].nbytes == most


@pytest.mark.parametrize("too_many", [2**32, 2**32 + 1, 2**33])
def test_more_bytes_than_msgpack_can_hold_are_refused(too_many: int) -> None:
    array = np.broadcast_to(np.uint8(0), too_many)  # of one byte

    with pytest.raises(ParameterError, match=f"size is '?{too_many} bytes"):
        array_document(array)
