"""What the encodings of a stream write, read by the wire contract."""

from typing import Any, cast

import numpy as np
import pytest

from transientcam import Frame, wire
from transientcam.density import step_up
from transientcam_driver import Sequence, open_camera
from transientcam_server.imaging import PRODUCTS, encoding_name, stream_encoding, travelling

_META: dict[str, Any] = {"frame": 1}


def _planes(pixels: int) -> Any:
    """Coefficients of random densities of three harmonics, as the product is."""
    draw = np.random.default_rng(4)
    reflection = draw.uniform(0.0, 0.97, (3, pixels)) * np.exp(
        1j * draw.uniform(0.0, 2.0 * np.pi, (3, pixels))
    )
    return step_up(draw.uniform(1.0, 100.0, pixels), reflection).astype(np.float32)


def test_every_encoding_of_the_contract_can_be_written_and_is_named_as_there() -> None:
    names = wire.encoding_names()
    assert names == ("f32", "u16", "reflection16")
    assert tuple(encoding_name(stream_encoding(name)) for name in names) == names


@pytest.mark.parametrize("name", sorted(PRODUCTS))
def test_the_channel_table_says_what_the_messages_of_each_encoding_hold(name: str) -> None:
    product = PRODUCTS[name]
    with open_camera("sim:wall") as camera:
        applied = camera.configure(Sequence(harmonics=3))
    if product.over_time:
        return
    shape = product.shape(applied, 4, 6)
    array = (
        _planes(24).reshape(7, 4, 6)
        if name == "coefficients"
        else np.ones(shape, product.description.dtype)
    )
    for chosen in product.description.encodings:
        encoding = stream_encoding(chosen)
        data = encoding.encode(
            Frame(
                name,
                "DN",
                product.description.axes,
                cast("wire.FrameMeta", _META),
                array,
                channel=3,
            )
        )
        travelled = wire.unpack(data, max_bytes=2**20)

        dtype, lengths = travelling(product, encoding, shape)
        assert (travelled["array"]["dtype"], travelled["array"]["shape"]) == (dtype, list(lengths))
        frame = wire.parse_frame(data)
        assert (frame.array.shape, frame.channel) == (shape, 3)
