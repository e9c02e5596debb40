"""Frames as files."""

import io
import json
from typing import Any

import numpy as np
import pytest

from tests.client.conftest import frame_meta
from transientcam import Frame, wire
from transientcam.cli.formats import Format, frame_bytes

_META = frame_meta(frame=7, host_time_s=1.5, pixels=None)
_RANGE = Frame("range", "m", ("y", "x"), _META, np.array([[1.5, np.nan]], "<f4"))
_TRANSIENT = Frame(
    "transient",
    "DN/s",
    ("time", "y", "x"),
    _META,
    np.ones((2, 1, 1), "<f4"),
    extra={"time_s": [0.0, 1e-9]},
)
_RAW = Frame(
    "raw",
    "DN",
    ("image", "y", "x"),
    _META,
    np.full((1, 1, 2), 4095, "<u2"),
    extra={"labels": [{"harmonic": 1, "phase_rad": 0.0}]},
)
_MOMENTS = Frame(
    "moments", "DN", ("moment", "y", "x"), _META, np.array([[[1 + 2j, np.nan]]], "<c8")
)


def test_npy_is_the_array() -> None:
    array = np.load(io.BytesIO(frame_bytes(_RANGE, Format.NPY)))

    assert array.dtype.str == "<f4"
    np.testing.assert_array_equal(array, _RANGE.array)


@pytest.mark.parametrize("frame", [_RANGE, _TRANSIENT, _RAW, _MOMENTS], ids=lambda f: f.product)
def test_npz_holds_the_array_and_what_it_means_without_pickle(frame: Frame) -> None:
    with np.load(io.BytesIO(frame_bytes(frame, Format.NPZ)), allow_pickle=False) as file:
        parts = dict(file)

    np.testing.assert_array_equal(parts.pop("array"), frame.array)
    assert parts.pop("product").item() == frame.product
    assert parts.pop("unit").item() == frame.unit
    assert tuple(parts.pop("axes")) == frame.axes
    assert json.loads(parts.pop("meta").item()) == _META
    if frame is _TRANSIENT:
        assert parts.pop("time_s").tolist() == [0.0, 1e-9]
    if frame is _RAW:
        assert json.loads(parts.pop("labels").item()) == [{"harmonic": 1, "phase_rad": 0.0}]
    assert parts == {}


@pytest.mark.parametrize("frame", [_RANGE, _TRANSIENT, _RAW, _MOMENTS], ids=lambda f: f.product)
def test_msgpack_is_the_message_of_the_daemon(frame: Frame) -> None:
    read = wire.parse_frame(frame_bytes(frame, Format.MSGPACK))

    assert (read.product, read.unit, read.axes) == (frame.product, frame.unit, frame.axes)
    assert (read.meta, read.extra) == (frame.meta, frame.extra)
    np.testing.assert_array_equal(read.array, frame.array)


@pytest.mark.parametrize(
    ("frame", "extra", "array"),
    [
        (_RANGE, {}, [[1.5, None]]),
        (_TRANSIENT, {"time_s": [0.0, 1e-9]}, [[[1.0]], [[1.0]]]),
        (_RAW, {"labels": [{"harmonic": 1, "phase_rad": 0.0}]}, [[[4095, 4095]]]),
        (_MOMENTS, {}, [[[[1.0, 2.0], [None, 0.0]]]]),
    ],
    ids=lambda value: value.product if isinstance(value, Frame) else "",
)
def test_json_is_everything_as_text(frame: Frame, extra: dict[str, Any], array: object) -> None:
    document = json.loads(frame_bytes(frame, Format.JSON))

    assert document == {
        "product": frame.product,
        "unit": frame.unit,
        "axes": list(frame.axes),
        "meta": _META,
        "array": array,
        **extra,
    }
