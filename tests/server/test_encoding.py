import io

import numpy as np
import pytest
from PIL import Image

from transientcam import wire
from transientcam_server.encoding import COLOUR_PNG, MSGPACK, NPY, PNG, Encoding, negotiate
from transientcam_server.errors import Problem
from transientcam_server.products import PRODUCTS

META = {"frame": 7, "base_frequency_hz": 23e6}


def encoded(encoding: Encoding, name: str, array: np.ndarray) -> bytes:
    return encoding.encode(PRODUCTS[name], array, META, {}, None)


def image_of(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)))


def test_msgpack_holds_the_array_and_the_meta() -> None:
    array = np.array([[1.5, np.nan], [2.25, -0.0]], dtype=np.float32)

    message = wire.parse_frame(encoded(MSGPACK, "range", array))

    np.testing.assert_array_equal(message.array, array)
    assert (message.product, message.unit, message.axes) == ("range", "m", ("y", "x"))
    assert message.meta == META
    assert message.channel is None
    assert message.encode_s >= 0.0


@pytest.mark.parametrize("encoding", [MSGPACK, NPY])
def test_arrays_travel_in_the_type_of_the_contract_whatever_they_were_computed_in(
    encoding: Encoding,
) -> None:
    array = np.asfortranarray(np.arange(6.0).reshape(2, 3))

    data = encoded(encoding, "direct", array)

    found = wire.parse_frame(data).array if encoding is MSGPACK else np.load(io.BytesIO(data))
    assert found.dtype == np.dtype("<f4")
    np.testing.assert_array_equal(found, array)


def test_a_png_of_range_counts_millimetres_and_0_is_no_value() -> None:
    range_m = np.array([[1.2344, np.nan], [0.0, 70.0]], dtype=np.float32)

    image = image_of(encoded(PNG, "range", range_m))

    assert image.dtype == np.uint16
    # 70 m is beyond 16 bits of millimetres and stays at the end of the scale
    np.testing.assert_array_equal(image, [[1234, 0], [0, 65535]])


def test_a_png_of_light_is_rounded_to_digital_numbers() -> None:
    image = image_of(encoded(PNG, "direct", np.array([[0.4, 0.6], [-3.0, np.inf]])))

    np.testing.assert_array_equal(image, [[0, 1], [0, 65535]])


def test_a_coloured_png_tells_values_apart_and_no_value_from_all() -> None:
    range_m = np.array([[0.1, 3.0, 6.0, np.nan]], dtype=np.float32)

    image = np.asarray(Image.open(io.BytesIO(encoded(COLOUR_PNG, "range", range_m))).convert("RGB"))

    assert len({tuple(pixel) for pixel in image[0]}) == 4
    assert tuple(image[0, 3]) == (48, 48, 48)


@pytest.mark.parametrize("values", [np.full((2, 2), np.nan), np.zeros((2, 2))])
def test_a_coloured_png_of_nothing_is_a_picture_all_the_same(values: np.ndarray) -> None:
    assert image_of(encoded(COLOUR_PNG, "direct", values)).shape == (2, 2)


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
        ("image/png;q=0, application/x-npy", NPY),
        ("image/png;q=nonsense, application/x-npy", NPY),
    ],
)
def test_the_format_a_client_likes_best_is_chosen(accept: str | None, expected: Encoding) -> None:
    assert negotiate(PRODUCTS["range"], suffix=None, accept=accept) is expected


def test_a_suffix_wins_over_the_accept_header() -> None:
    assert negotiate(PRODUCTS["range"], suffix="npy", accept="image/png") is NPY


@pytest.mark.parametrize(
    ("name", "suffix", "accept"),
    [
        ("range", "tiff", None),
        ("range", "", None),
        ("range", "colour-png", None),
        ("moments", "png", None),
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
    expected = ["msgpack", "npy"] + ["png"] * (name == "range")
    assert caught.value.extensions["supported"] == expected
