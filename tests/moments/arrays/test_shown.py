"""Results state what they hold in a line, and show a map in notebooks."""

import base64
import io
import re

import jax
import matplotlib
import numpy as np
from PIL import Image

import transientcam_moments as tm
from tests.moments import oracles
from transientcam_moments.arrays import map_html

MOMENTS = oracles.random_moments(np.random.default_rng(0), 2, 12).reshape((3, 3, 4))


def picture(html: str) -> Image.Image:
    source = re.search('src="data:image/bmp;base64,([^"]+)"', html)
    assert source is not None
    return Image.open(io.BytesIO(base64.b64decode(source.group(1))))


def test_a_map_has_its_pixels_in_place_brighter_with_the_value_and_grey_without() -> None:
    values = np.linspace(1.0, 2.0, 15).reshape((3, 5))
    values[0, 1] = np.nan

    html = map_html(values, title="a < b", unit="m")

    assert "a &lt; b, 5 x 3 pixels" in html
    assert "<span>1.0" in html
    assert " m</span></div>" in html
    shown = np.asarray(picture(html).convert("RGB"))
    assert shown.shape == (3, 5, 3)
    assert shown[0, 1].tolist() == [70, 90, 110]
    brightness = np.delete(shown.astype(int).sum(axis=2).ravel(), 1)
    assert (np.diff(brightness) >= 0).all()
    assert brightness[0] < 60
    assert brightness[-1] > 600


def test_a_map_has_the_colours_of_a_known_scale() -> None:
    values = np.repeat(np.arange(5.0), 40)[None]  # 1 and 99 % of them are the ends of the scale

    shown = np.asarray(picture(map_html(values, title="t", unit="m")).convert("RGB"))[0, ::40]

    inferno = matplotlib.colormaps["inferno"](np.arange(5) / 4)[:, :3] * 255
    np.testing.assert_allclose(shown[1:], inferno[1:], atol=1.6)  # 256 colours
    np.testing.assert_array_equal(shown[0], 0)


def test_a_map_of_more_pixels_than_a_screen_is_thinned_out_and_an_empty_one_is_words() -> None:
    assert picture(map_html(np.ones((1300, 20)), title="t", unit="m")).size == (7, 434)
    assert "no pixel has a value" in map_html(np.full((2, 2), np.nan), title="t", unit="m")


def test_a_reconstruction_shows_its_range_and_without_a_frequency_its_brightness() -> None:
    ranged = tm.reconstruct(MOMENTS, tm.Settings(base_frequency_hz=23e6))
    unranged = tm.reconstruct(MOMENTS)
    single = tm.reconstruct(MOMENTS[:, 0, 0], tm.Settings(base_frequency_hz=23e6))

    html = ranged._repr_html_()
    assert "range, 4 x 3 pixels" in html
    assert "range_m" in html
    assert picture(html).size == (4, 3)
    assert "brightness, 4 x 3 pixels" in unranged._repr_html_()
    assert "<img" not in single._repr_html_()
    assert single._repr_html_().startswith("<p>&lt;Reconstruction m = 2")


def test_a_result_of_arrays_states_their_shapes_and_spans() -> None:
    found = tm.levinson(MOMENTS)

    low, high = found.error.min(), found.error.max()
    assert repr(found).startswith(f"<Coefficients: error 3 x 4, {low:.4g} to {high:.4g}, median ")
    assert "polynomial 3 x 3 x 4 complex128" in repr(found)


def test_a_traced_result_has_a_text_too() -> None:
    texts = []

    def traced(b: jax.Array) -> jax.Array:
        found = tm.levinson(b)
        texts.append(repr(found))
        error: jax.Array = found.error
        return error

    jax.jit(traced)(jax.numpy.asarray(MOMENTS.astype(np.complex64)))

    assert texts == [
        "<Coefficients: error 3 x 4 float32; polynomial 3 x 3 x 4 complex64; "
        "reflection 2 x 3 x 4 complex64>"
    ]
