"""Products as pictures: PNG that holds the values, and colours for eyes. Runs on workers."""

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging.products import Product

if TYPE_CHECKING:
    from PIL.Image import Image

_Array = NDArray[Any]
_JPEG_QUALITY = 85


def png(product: Product, array: _Array, *_: Any) -> bytes:
    """Return 16 bits a pixel: steps of `Product.png_unit`; 0 where there is no value."""
    from PIL import Image  # 60 ms that the first frame need not wait for

    assert product.png_scale is not None  # noqa: S101 - `Encoding.fits` was asked
    steps = np.nan_to_num(np.asarray(array, dtype=np.float64) * product.png_scale, posinf=65535.0)
    image = Image.fromarray(np.clip(np.rint(steps), 0, 65535).astype(np.uint16))
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=1)
    return file.getvalue()


def colour_png(product: Product, array: _Array, meta: Mapping[str, Any], *_: Any) -> bytes:
    """Return 8 bits a pixel through a palette: for eyes, not for measuring."""
    file = io.BytesIO()
    _coloured(product, array, meta).save(file, format="PNG", compress_level=1)
    return file.getvalue()


def colour_jpeg(product: Product, array: _Array, meta: Mapping[str, Any], *_: Any) -> bytes:
    """Return the same as JPEG, which is smaller."""
    file = io.BytesIO()
    _coloured(product, array, meta).convert("RGB").save(file, "JPEG", quality=_JPEG_QUALITY)
    return file.getvalue()


def _coloured(product: Product, array: _Array, meta: Mapping[str, Any]) -> "Image":
    from PIL import Image  # as above

    low, high = _colour_range(product, array, meta)
    with np.errstate(invalid="ignore"):  # NaN becomes index 0 below
        index = 1.0 + 254.0 * np.clip((array - low) / max(high - low, 1e-30), 0.0, 1.0)
    image = Image.fromarray(np.nan_to_num(index, nan=0.0).astype(np.uint8), mode="P")
    image.putpalette(_palette())
    return image


def _colour_range(product: Product, array: _Array, meta: Mapping[str, Any]) -> tuple[float, float]:
    if product.description.unit == "m":
        # the same colours in every frame: the unambiguous range
        return 0.0, 299_792_458.0 / (2.0 * meta["base_frequency_hz"])
    finite = array[np.isfinite(array)]
    return (0.0, float(np.percentile(finite, 99.5))) if finite.size else (0.0, 1.0)


def _palette() -> bytes:
    """Index 0 (no value) dark grey; then dark blue over green and orange to near white."""
    stops = np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * 254.0
    channels = ((30, 30, 40, 235, 255), (20, 90, 170, 160, 250), (90, 200, 130, 50, 220))
    index = np.arange(255.0)
    colours = np.stack([np.interp(index, stops, channel) for channel in channels], axis=-1)
    ramp: bytes = np.rint(colours).astype(np.uint8).tobytes()
    return bytes((48, 48, 48)) + ramp
