"""Requests for frames: which one, which part of what, in which format."""

import math
from typing import Any

import numpy as np
import pytest

from tests.client.conftest import Recording
from transientcam import wire
from transientcam.errors import ParameterError, ProtocolError
from transientcam.requests import Answer, Part, Request, Which, frames
from transientcam.requests._frames import FILE_TYPES


def test_times_of_flight_keep_every_digit() -> None:
    times_s = np.array([1.1e-9, 1 / 3, np.float32(0.1)])

    request = frames.frame("transient", Which(), Part(time_s=times_s))

    assert [name for name, _ in request.params] == ["time_s"] * 3
    assert [float(value) for _, value in request.params] == times_s.tolist()


def test_a_single_time_of_flight_is_one() -> None:
    assert frames.frame("transient", Which(), Part(time_s=1e-9)).params == (("time_s", "1e-09"),)


@pytest.mark.parametrize("time_s", [math.nan, [math.inf], [[1.0]]])
def test_times_that_are_none_are_refused(time_s: object) -> None:
    with pytest.raises(ParameterError, match="time_s is"):
        frames.frame("transient", Which(), Part(time_s=time_s))


@pytest.mark.parametrize("product", ["", "../sequence", "a/b", "a?b", "a b", "range.npy", "é/"])
def test_a_product_that_is_no_name_never_becomes_a_path(product: str) -> None:
    with pytest.raises(ParameterError, match="product is"):
        frames.frame(product, Which())
    with pytest.raises(ParameterError, match="product is"):
        frames.file(product, "png", Which())


def test_a_request_that_waits_has_a_longer_timeout() -> None:
    request = frames.meta(Which(wait_s=7.5, after=3))

    assert request.params == (("wait_s", "7.5"), ("after", "3"))
    assert request.extra_timeout_s == 7.5
    assert frames.meta(Which()).extra_timeout_s == 0.0


def test_a_frame_is_read_from_the_body(recorded: dict[str, Recording]) -> None:
    request = frames.frame("range", Which())

    frame = request.result(Answer(200, wire.MEDIA_TYPE, recorded["frame"].data))

    assert frame.product == "range"
    assert request.headers["accept"] == "application/vnd.msgpack, application/problem+json"


@pytest.mark.parametrize(
    ("request_", "media_type"),
    [
        (frames.frame("range", Which()), "image/png"),
        (frames.file("range", "png", Which()), "text/html"),
    ],
)
def test_a_body_of_another_kind_is_refused(request_: Request[Any], media_type: str) -> None:
    with pytest.raises(ProtocolError, match="content-type is"):
        request_.result(Answer(200, media_type, b"\x89PNG"))


@pytest.mark.parametrize(
    ("which", "path"),
    [
        (Which(), "frames/latest"),
        (Which(number=7), "frames/7"),
        (
            Which(recording="20261120T081500Z-3f9c2a"),
            "recordings/20261120T081500Z-3f9c2a/frames/latest",
        ),
        (Which(recording="a", number=3), "recordings/a/frames/3"),
    ],
)
def test_a_frame_is_the_newest_or_one_by_its_number_also_of_a_recording(
    which: Which, path: str
) -> None:
    assert frames.meta(which).path == path
    assert frames.frame("range", which).path == f"{path}/range.msgpack"
    assert frames.file("range", "tiff", which).path == f"{path}/range.tiff"
    assert frames.pixel(which, x=1, y=2).path == f"{path}/pixel"


@pytest.mark.parametrize("which", [Which(number=0), Which(number=-3), Which(recording="../x")])
def test_what_is_no_frame_never_becomes_a_path(which: Which) -> None:
    with pytest.raises(ParameterError):
        frames.meta(which)


def test_a_part_is_a_region_and_every_so_many_pixels_of_it() -> None:
    part = Part(region=np.array([40, 30, 64, 48]), decimation=2)  # type: ignore[arg-type]  # will do

    assert frames.frame("range", Which(), part).params == (
        ("region", "40,30,64,48"),
        ("decimation", "2"),
    )


@pytest.mark.parametrize("region", [(1, 2, 3), (1, 2, 3, 4.5), "1,2,3,4", ()])
def test_a_region_is_four_whole_numbers(region: Any) -> None:
    with pytest.raises(ParameterError, match="region is"):
        frames.frame("range", Which(), Part(region=region))


@pytest.mark.parametrize(("form", "media_type"), FILE_TYPES.items())
def test_a_file_is_asked_for_and_read_as_what_it_is(form: str, media_type: str) -> None:
    request = frames.file("range", form, Which())

    assert request.accept == media_type
    assert request.result(Answer(200, media_type, b"data")) == b"data"


def test_an_unknown_format_is_refused_before_anything_is_sent() -> None:
    with pytest.raises(ParameterError, match="form is 'bmp', but must be one of png, npy"):
        frames.file("range", "bmp", Which())
