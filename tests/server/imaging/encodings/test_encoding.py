import io
import json
import struct
from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image

from transientcam import Frame, wire
from transientcam_server.api._frame_query import negotiate
from transientcam_server.errors import Problem
from transientcam_server.imaging import (
    COLOUR_JPEG,
    COLOUR_PNG,
    MSGPACK,
    PNG,
    PRODUCTS,
    TIFF,
    Encoding,
)
from transientcam_server.imaging._encodings.encoding import CSV, NPY, NPZ, PLY

META = cast("wire.FrameMeta", {"frame": 7, "base_frequency_hz": 23e6})


def encoded(
    encoding: Encoding, name: str, array: np.ndarray, extra: Mapping[str, Any] | None = None
) -> bytes:
    product = wire.PRODUCTS[name]
    array = np.asarray(array, dtype=product.dtype, order="C")
    return encoding.encode(Frame(name, product.unit, product.axes, META, array, extra=extra or {}))


def image_of(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)))


def test_msgpack_holds_the_array_and_the_meta() -> None:
    array = np.array([[1.5, np.nan], [2.25, -0.0]], dtype=np.float32)

    message = wire.parse_frame(encoded(MSGPACK, "range", array))

    np.testing.assert_array_equal(message.array, array)
    assert (message.product, message.unit, message.axes) == ("range", "m", ("y", "x"))
    assert dict(message.meta) == META
    assert message.channel is None
    assert message.encode_s >= 0.0


def test_a_png_of_range_counts_millimetres_and_0_is_no_value() -> None:
    range_m = np.array([[1.2344, np.nan], [0.0, 70.0]], dtype=np.float32)

    image = image_of(encoded(PNG, "range", range_m))

    assert image.dtype == np.uint16
    # 70 m is beyond 16 bits of millimetres: no value, rather than one that is wrong
    np.testing.assert_array_equal(image, [[1234, 0], [0, 0]])


def test_a_png_of_light_is_rounded_to_digital_numbers() -> None:
    image = image_of(encoded(PNG, "direct", np.array([[0.4, 0.6], [-3.0, np.inf]])))

    np.testing.assert_array_equal(image, [[0, 1], [0, 0]])


def test_a_png_says_itself_what_its_steps_are() -> None:
    file = Image.open(io.BytesIO(encoded(PNG, "range", np.ones((2, 2)))))

    assert file.info["Unit"] == "mm"
    assert "65535" in file.info["Comment"]


def test_a_coloured_png_distinguishes_values_and_no_value_from_all() -> None:
    range_m = np.array([[0.1, 3.0, 6.0, np.nan]], dtype=np.float32)

    image = np.asarray(Image.open(io.BytesIO(encoded(COLOUR_PNG, "range", range_m))).convert("RGB"))

    assert len({tuple(pixel) for pixel in image[0]}) == 4
    assert tuple(image[0, 3]) == (48, 48, 48)


@pytest.mark.parametrize("values", [np.full((2, 2), np.nan), np.zeros((2, 2))])
def test_a_coloured_png_of_nothing_is_a_picture_all_the_same(values: np.ndarray) -> None:
    assert image_of(encoded(COLOUR_PNG, "direct", values)).shape == (2, 2)


def test_a_coloured_jpeg_shows_what_the_coloured_png_shows() -> None:
    range_m = np.linspace(0.0, 6.0, 64 * 64, dtype=np.float32).reshape(64, 64)

    jpeg = image_of(encoded(COLOUR_JPEG, "range", range_m)).astype(float)

    picture = Image.open(io.BytesIO(encoded(COLOUR_PNG, "range", range_m))).convert("RGB")
    assert np.abs(jpeg - np.asarray(picture)).max() < 40.0


def test_npz_holds_everything_without_pickle() -> None:
    extra = {"time_s": [0.0, 1e-9], "intrinsics": {"fx": 1.0}, "y": 3}
    array = np.ones((2, 1, 1))

    data = encoded(NPZ, "transient", array, extra)

    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        parts = dict(file)
    assert parts["array"].dtype == np.dtype("<f4")
    assert parts["axes"].tolist() == ["time", "y", "x"]
    assert parts["unit"] == "DN/s"
    assert json.loads(parts["meta"].item()) == META
    assert parts["time_s"].tolist() == [0.0, 1e-9]
    assert parts["y"] == 3
    assert json.loads(parts["intrinsics"].item()) == {"fx": 1.0}


@pytest.mark.parametrize(
    ("name", "dtype", "shape"),
    [("range", "<f4", (3, 5)), ("flags", "|u1", (3, 5)), ("raw", "<u2", (4, 3, 5))],
)
def test_a_tiff_is_read_by_another_library_value_by_value(
    name: str, dtype: str, shape: tuple[int, ...]
) -> None:
    array = np.arange(np.prod(shape)).reshape(shape).astype(dtype)

    with Image.open(io.BytesIO(encoded(TIFF, name, array))) as image:
        description, pages = json.loads(image.tag_v2[270]), []  # type: ignore[attr-defined]  # of TIFF
        for page in range(getattr(image, "n_frames", 1)):
            image.seek(page)
            pages.append(np.asarray(image))

    np.testing.assert_array_equal(np.squeeze(pages), array)
    assert np.asarray(pages).dtype.itemsize == np.dtype(dtype).itemsize
    assert description["product"] == name
    assert description["meta"] == META


def test_a_tiff_keeps_pixels_without_a_value() -> None:
    range_m = np.array([[1.5, np.nan]], dtype=np.float32)

    image = image_of(encoded(TIFF, "range", range_m))

    np.testing.assert_array_equal(image, range_m)


def test_csv_is_a_line_for_each_row() -> None:
    range_m = np.array([[1.5, np.nan], [0.1, -0.0]], dtype=np.float32)

    text = encoded(CSV, "range", range_m).decode()

    assert text.splitlines()[0] == "1.5,nan"
    found = np.loadtxt(io.StringIO(text), delimiter=",", dtype=np.float32)
    np.testing.assert_array_equal(found, range_m)
    assert encoded(CSV, "flags", np.array([[0, 4]], np.uint8)) == b"0,4\n"


def read_ply(data: bytes) -> dict[str, list[float]]:
    """Read vertices one by one, as the format's description says."""
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    codes = {"float": "f", "uchar": "B"}
    fields = [line.split()[1:] for line in lines if line.startswith("property")]
    count = int(next(line.split()[2] for line in lines if line.startswith("element vertex")))
    vertex = struct.Struct("<" + "".join(codes[kind] for kind, _ in fields))
    assert len(body) == count * vertex.size
    rows = [vertex.unpack_from(body, index * vertex.size) for index in range(count)]
    names = [name for _, name in fields]
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def test_a_ply_holds_the_points_that_have_a_range_and_what_they_look_like() -> None:
    points = np.array([[[1.0, np.nan, 4.0]], [[2.0, np.nan, 5.0]], [[3.0, np.nan, 6.0]]])
    beside = {
        "range": np.array([[3.5, np.nan, 8.5]]),
        "direct": np.array([[100.0, 0.0, 200.0]]),
        "flags": np.array([[0, 2, 1]], dtype=np.uint8),
    }

    data = encoded(PLY, "pointcloud", points, beside)

    assert read_ply(data) == {
        "x": [1.0, 4.0],
        "y": [2.0, 5.0],
        "z": [3.0, 6.0],
        "range": [3.5, 8.5],
        "amplitude": [100.0, 200.0],
        "flags": [0, 1],
    }


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        (None, MSGPACK),
        ("*/*", MSGPACK),
        ("image/png", PNG),
        ("image/*", PNG),
        ("application/x-npy", NPY),
        ("application/msgpack", MSGPACK),
        ("application/x-msgpack", MSGPACK),
        ("application/vnd.msgpack;q=0.3, image/png;q=0.9", PNG),
        ("text/html, image/png;q=0.5, */*;q=0.1", PNG),
        ("text/html, */*;q=0.1", MSGPACK),
        ("text/csv", CSV),
        ("image/tiff, image/png;q=0.5", TIFF),
        ("application/x-npz", NPZ),
        ("image/png;q=0, application/x-npy", NPY),
        ("image/png;q=nonsense, application/x-npy", NPY),
    ],
)
def test_the_format_a_client_likes_best_is_chosen(accept: str | None, expected: Encoding) -> None:
    assert negotiate(PRODUCTS["range"], suffix=None, accept=accept) is expected


def test_an_image_is_a_png_if_it_can_be_one_and_else_a_tiff() -> None:
    assert negotiate(PRODUCTS["range"], suffix=None, accept="image/*") is PNG
    assert negotiate(PRODUCTS["raw"], suffix=None, accept="image/*") is TIFF


def test_a_suffix_wins_over_the_accept_header() -> None:
    assert negotiate(PRODUCTS["range"], suffix="npy", accept="image/png") is NPY


@pytest.mark.parametrize(
    ("name", "suffix", "accept"),
    [
        ("range", "bmp", None),
        ("range", "ply", None),
        ("moments", "tiff", None),
        ("range", "", None),
        ("range", "colour-png", None),
        ("moments", "png", None),
        ("raw", "csv", None),
        ("raw", None, "image/png"),
        ("range", None, "text/html"),
        ("range", None, "image/png;q=0"),
    ],
)
def test_a_format_the_product_has_not_is_refused_with_those_it_has(
    name: str, suffix: str | None, accept: str | None
) -> None:
    with pytest.raises(Problem) as caught:
        negotiate(PRODUCTS[name], suffix=suffix, accept=accept)

    assert caught.value.kind.status == 406
    more = {"range": ["png", "tiff", "csv"], "raw": ["tiff"], "moments": []}
    expected = ["msgpack", "npy", "npz", *more[name]]
    assert caught.value.extensions["supported"] == expected
