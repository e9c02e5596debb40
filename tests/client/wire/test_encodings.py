"""Arrays in fewer bytes, against the arrays themselves."""

import contextlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from transientcam import density, wire
from transientcam.density import step_down, step_up
from transientcam.errors import ProtocolError
from transientcam.wire._encodings import ENCODINGS, decoded, measured_error

_PHASES_RAD = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)


@given(
    hnp.arrays(
        np.float32,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=6),
        elements=st.floats(-(2.0**100), 2.0**100, width=32) | st.just(np.float32(np.nan)),
    )
)
def test_u16_is_off_by_half_a_step_at_most_and_keeps_what_has_no_value(
    image: NDArray[np.float32],
) -> None:
    codes, said = wire.encode_u16(image)

    again = wire.decode_u16(codes, **said)

    assert codes.dtype == np.uint16
    assert again.dtype == np.float32
    np.testing.assert_array_equal(np.isnan(again), np.isnan(image))
    error = np.abs(again.astype(np.float64) - image)
    # beside the half step, float32 itself rounds the result
    allowed = 0.5 * said["scale"] * (1.0 + 1e-6) + np.spacing(np.abs(image)).astype(np.float64)
    assert (error <= allowed)[~np.isnan(image)].all()


def test_u16_spends_its_steps_on_the_values_there_are() -> None:
    image = np.array([[2.0, 5.0], [np.nan, np.inf]], np.float32)

    codes, said = wire.encode_u16(image)

    assert codes.tolist() == [[1, 65535], [0, 0]]
    assert said["scale"] == pytest.approx(3.0 / 65534.0)
    assert said["offset"] + said["scale"] * 65535 == pytest.approx(5.0)


@pytest.mark.parametrize("value", [np.nan, 7.25])
def test_u16_of_an_image_of_one_value_is_exact(value: float) -> None:
    image = np.full((3, 2), value, np.float32)
    codes, said = wire.encode_u16(image)

    np.testing.assert_array_equal(wire.decode_u16(codes, **said), image)


def _pixels(harmonics: int, *, smallest: float, seed: int = 1) -> NDArray[np.float32]:
    """Coefficients of random densities of which 1 - |g|^2 of all orders multiply to no less."""
    draw = np.random.default_rng(seed)
    share = draw.dirichlet(np.ones(harmonics), 500).T
    size = np.sqrt(1.0 - smallest**share)
    turn = np.exp(1j * draw.uniform(0.0, 2.0 * np.pi, size.shape))
    return step_up(draw.uniform(10.0, 1000.0, 500), size * turn).astype(np.float32)


# The bias of the paper keeps E / b_0, which is the product over the orders, above 4e-3.
@pytest.mark.parametrize("harmonics", [1, 2, 3, 4, 8])
def test_the_density_of_reflection16_is_within_half_a_percent_and_seldom_beyond_ten(
    harmonics: int,
) -> None:
    planes = _pixels(harmonics, smallest=4e-3)
    exact = density(planes.astype(np.float64), _PHASES_RAD)

    codes, said = wire.encode_reflection16(planes)
    again = wire.decode_reflection16(codes, np.frombuffer(said["brightness"]["data"], "<f4"))

    assert (codes.shape, codes.dtype.str) == ((2 * harmonics, 500), "<u2")
    assert again.shape == planes.shape
    error = np.abs(density(again.astype(np.float64), _PHASES_RAD) - exact) / exact.max(axis=0)
    assert np.median(error.max(axis=0)) < 0.005
    assert np.quantile(error.max(axis=0), 0.99) < 0.1


@given(codes=hnp.arrays(np.uint16, (6, 4), elements=st.integers(0, 65535)))
def test_any_codes_are_a_density_that_is_nowhere_negative(codes: NDArray[np.uint16]) -> None:
    coefficients = wire.decode_reflection16(codes, np.ones(4, np.float32))
    values = density(coefficients.astype(np.float64), _PHASES_RAD)

    assert np.isfinite(coefficients).all()
    assert (values >= 0.0).all()


@pytest.mark.parametrize("smallest", [1e-3, 1e-7, 1e-12])
def test_rounding_never_puts_a_reflection_onto_the_border(smallest: float) -> None:
    planes = _pixels(2, smallest=smallest)

    codes, _ = wire.encode_reflection16(planes)

    parts = (codes.astype(np.float64) - 32768.0) / 32767.0
    assert np.hypot(parts[0::2], parts[1::2]).max() < 1.0


def test_reflection16_keeps_pixels_without_a_value_and_without_light() -> None:
    planes = _pixels(3, smallest=0.1)[:, :3].copy()
    planes[:, 0] = np.nan
    planes[:, 1] = 0.0

    codes, said = wire.encode_reflection16(planes)
    again = wire.decode_reflection16(codes, np.frombuffer(said["brightness"]["data"], "<f4"))

    assert np.isnan(again[:, 0]).all()
    assert not again[:, 1].any()
    np.testing.assert_allclose(again[:, 2], planes[:, 2], rtol=0.01, atol=0.01)


@pytest.mark.parametrize("reflection", [1.0 + 1e-6, 1.2, 1e6])
def test_a_reflection_beyond_the_border_is_sent_as_just_within(reflection: float) -> None:
    planes = np.array([[1.0], [reflection], [0.0]], np.float32)
    found = step_down(planes)[1]
    assert abs(complex(found[0, 0])) > 1.0

    codes, _ = wire.encode_reflection16(planes)

    # |g| = 1 is u = 1 - 2 / 32767, which is 32765 steps from the middle
    direction = found[0, 0] / abs(found[0, 0])
    parts = [32768 + 32765 * direction.real, 32768 + 32765 * direction.imag]
    assert codes[:, 0].tolist() == pytest.approx(parts, abs=0.5)


def test_the_stated_error_is_the_largest_over_pixels_at_128_phases() -> None:
    planes = _pixels(3, smallest=0.05)[:, :200]
    coded = wire.encode_reflection16(planes)
    coded = coded._replace(array=coded.array // 512 * 512)  # errors far above those of float32

    median, most = measured_error(planes, coded)

    phase_rad = np.arange(128) * 2.0 * np.pi / 128
    worst = []
    brightness = np.frombuffer(coded.fields["brightness"]["data"], "<f4")
    again = wire.decode_reflection16(coded.array, brightness)
    for pixel in range(200):
        exact = density(planes[:, pixel].astype(np.float64), phase_rad)
        found = density(again[:, pixel].astype(np.float64), phase_rad)
        worst.append(np.abs(found - exact).max() / exact.max())
    assert most == pytest.approx(max(worst), rel=1e-5)
    assert median == pytest.approx(np.median(worst), rel=1e-5)


@pytest.mark.parametrize(("pixels", "step"), [(1024, 1), (1025, 2), (2048, 2), (2049, 3)])
def test_at_most_1024_pixels_are_judged_evenly_spread(pixels: int, step: int) -> None:
    planes = np.repeat(_pixels(2, smallest=0.1)[:, :1], pixels, axis=1)
    coded = wire.encode_reflection16(planes)

    for spoilt in (0, 1, 2, 3, pixels - 1):
        codes = coded.array.copy()
        codes[:, spoilt] = 32768  # an even density
        _, most = measured_error(planes, coded._replace(array=codes))
        assert (most > 0.1) == (spoilt % step == 0)


def test_an_image_without_light_has_no_error() -> None:
    planes = np.zeros((7, 5), np.float32)
    planes[:, 2:] = np.nan

    assert measured_error(planes, wire.encode_reflection16(planes)) == (0.0, 0.0)


@pytest.mark.parametrize("name", ["u16", "reflection16"])
@pytest.mark.parametrize("axes", [("y", "x"), ("coefficient", "y", "x"), ("x", "y"), ("y",)])
@pytest.mark.parametrize("dtype", ["<f4", "<u2"])
def test_images_of_float_go_as_u16_and_coefficients_as_reflection16(
    name: str, axes: tuple[str, ...], dtype: str
) -> None:
    fits = ENCODINGS[name].fits(axes, dtype)

    assert fits == (
        (name, axes, dtype) == ("u16", ("y", "x"), "<f4")
        or (name, axes) == ("reflection16", ("coefficient", "y", "x"))
    )


def test_codes_have_the_shape_that_is_announced() -> None:
    image, planes = np.ones((4, 6), np.float32), _pixels(3, smallest=0.1)[:, :6].reshape(7, 2, 3)

    for name, array in (("u16", image), ("reflection16", planes)):
        encoding = ENCODINGS[name]
        codes = encoding.encode(array).array
        assert (codes.shape, codes.dtype.str) == (encoding.shape(array.shape), encoding.dtype)


def _message(array: NDArray[Any], product: str = "range", **said: Any) -> bytes:
    axes = ("coefficient", "y", "x")[-array.ndim :]
    return wire.encode_frame(
        product=product, unit="m", axes=axes, meta={"frame": 1}, array=array, extra=said
    )


def test_a_message_in_u16_arrives_as_the_values() -> None:
    image = np.array([[1.0, np.nan], [2.0, 4.0]], np.float32)
    codes, said = wire.encode_u16(image)

    frame = wire.parse_frame(_message(codes, encoding="u16", **said))

    np.testing.assert_allclose(frame.array, image, atol=0.5 * said["scale"])
    assert frame.extra["encoding"] == "u16"


def test_a_message_in_reflection16_arrives_as_coefficients() -> None:
    planes = _pixels(3, smallest=0.1)[:, :6].reshape(7, 2, 3)
    codes, said = wire.encode_reflection16(planes)

    frame = wire.parse_frame(
        _message(codes, "coefficients", encoding="reflection16", approximate=True, **said)
    )

    np.testing.assert_allclose(frame.array, planes, rtol=0.01, atol=0.01)
    assert frame.extra == {"encoding": "reflection16", "approximate": True}


_CODES = np.zeros((2, 3), "<u2")
_PLANES = np.zeros((4, 2, 3), "<u2")
_BRIGHTNESS = wire.array_document(np.ones((2, 3), "<f4"))


@pytest.mark.parametrize(
    ("array", "said", "field"),
    [
        (_CODES, {"encoding": "u8"}, "encoding"),
        (_CODES, {"encoding": 7}, "encoding"),
        (_CODES, {"encoding": "u16", "offset": 0.0}, "scale"),
        (_CODES, {"encoding": "u16", "scale": 1.0, "offset": float("nan")}, "offset"),
        *(
            (_CODES.astype(each), {"encoding": "u16", "scale": 1.0, "offset": 0.0}, "array.dtype")
            for each in sorted(set(wire.DTYPES) - {"<u2"})
        ),
        (_PLANES, {"encoding": "u16", "scale": 1.0, "offset": 0.0}, "array.shape"),
        (_CODES, {"encoding": "reflection16", "brightness": _BRIGHTNESS}, "array.shape"),
        (_PLANES[:3], {"encoding": "reflection16", "brightness": _BRIGHTNESS}, "array.shape"),
        (_PLANES, {"encoding": "reflection16"}, "brightness"),
        (
            _PLANES,
            {"encoding": "reflection16", "brightness": wire.array_document(np.ones((3, 2), "<f4"))},
            "brightness.shape",
        ),
        *(
            (
                _PLANES,
                {
                    "encoding": "reflection16",
                    "brightness": wire.array_document(np.ones((2, 3), each)),
                },
                "brightness.shape",
            )
            for each in sorted(set(wire.DTYPES) - {"<f4"})
        ),
        (_PLANES[:0], {"encoding": "reflection16", "brightness": _BRIGHTNESS}, "array.shape"),
    ],
)
def test_codes_that_cannot_be_read_are_refused_by_name(
    array: NDArray[Any], said: dict[str, Any], field: str
) -> None:
    with pytest.raises(ProtocolError) as caught:
        wire.parse_frame(_message(array, **said))

    assert caught.value.field == field


@given(scale=st.floats(), offset=st.floats(), codes=hnp.arrays(np.uint16, (2, 2)))
def test_no_scale_in_a_message_raises_anything_else(
    scale: float, offset: float, codes: NDArray[np.uint16]
) -> None:
    with contextlib.suppress(ProtocolError):
        decoded("u16", codes, {"scale": scale, "offset": offset})
