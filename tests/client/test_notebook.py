"""What notebooks show: maps with scale and unit, and tables."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from tests.client.conftest import frame_meta
from transientcam import Camera, Frame
from transientcam.notebook import map_html, palette, table_html


def picture(page: str) -> Image.Image:
    found = re.search(r"base64,([^\"]+)", page)
    assert found is not None
    return Image.open(io.BytesIO(base64.b64decode(found.group(1))))


def test_a_map_has_its_values_in_colours_and_its_scale_in_its_unit() -> None:
    values = np.linspace(1.0, 3.0, 101 * 7).reshape(7, 101)
    values[2, 3] = np.nan

    page = map_html(values, title="range, frame 7", unit="m")

    with picture(page) as image:
        shown = np.asarray(image.convert("RGB"))
    colours = np.frombuffer(palette(), np.uint8).reshape(256, 3)
    assert shown.shape == (7, 101, 3)
    assert shown[2, 3].tolist() == colours[0].tolist()
    assert shown[0, 0].tolist() == colours[1].tolist()
    assert shown[-1, -1].tolist() == colours[255].tolist()
    assert "<span>1.02 m</span><span>2.98 m</span>" in page
    assert "range, frame 7, 101 x 7 pixels" in page


def test_a_large_map_is_thinned_out() -> None:
    with picture(map_html(np.ones((2000, 10)), title="", unit="m")) as image:
        assert image.size == (3, 500)


def test_a_map_without_values_says_so() -> None:
    assert map_html(np.full((2, 2), np.nan), title="range", unit="m") == (
        "<p>range: no pixel has a value</p>"
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("value", [0, 255])
def test_equal_values_are_a_map_too(value: int) -> None:
    assert "<img" in map_html(np.full((3, 4), value, np.uint8), title="flags", unit="1")


def test_names_in_a_table_are_text() -> None:
    page = table_html("<b>", {"a<b": 0.1 + 0.2, "sub_phases": {"scheme": "none", "n": 1}})

    assert page == (
        "<p>&lt;b&gt;</p><table><tr><th>a&lt;b</th><td>0.3</td></tr>"
        "<tr><th>sub_phases</th><td>scheme none, n 1</td></tr></table>"
    )


def test_an_image_is_a_map_and_another_product_a_table() -> None:
    def frame(product: str, axes: tuple[str, ...], shape: tuple[int, ...], dtype: str) -> Frame:
        return Frame(product, "DN", axes, frame_meta(frame=7), np.ones(shape, dtype))

    assert "<img" in frame("direct", ("y", "x"), (4, 5), "<f4")._repr_html_()
    page = frame("moments", ("moment", "y", "x"), (3, 4, 5), "<c8")._repr_html_()
    assert "<th>moment</th><td>3</td>" in page


def test_a_camera_that_does_not_answer_says_so() -> None:
    with Camera("http://127.0.0.1:9", timeout_s=0.5) as camera:
        assert "No camera answers" in camera._repr_html_()
