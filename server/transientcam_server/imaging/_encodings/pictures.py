"""Products as pictures: PNG that holds the values, and colours for eyes. Runs on workers."""

import io
from typing import TYPE_CHECKING

import numpy as np

from transientcam import Frame
from transientcam.notebook import palette
from transientcam_server.imaging._products.products import product_of

if TYPE_CHECKING:
    from PIL.Image import Image

_JPEG_QUALITY = 85
_MOST_STEPS = 65535


def png(frame: Frame) -> bytes:
    """Return 16 bits a pixel: the steps of its product.

    0 where there is no value, or one that has no steps from 1 to 65535. The unit of a step is also
    in the file, as the header's is lost when it is saved.
    """
    from PIL import Image, PngImagePlugin  # 60 ms that the first frame need not wait for

    steps_of = product_of(frame.product).png_steps
    assert steps_of is not None  # noqa: S101 - `Encoding.fits` excludes it
    values = np.asarray(frame.array, dtype=np.float64)
    steps = np.rint(values * steps_of.per_unit)
    there = (steps >= 0) & (steps <= _MOST_STEPS)
    image = Image.fromarray(np.where(there, steps, 0).astype(np.uint16))
    text = PngImagePlugin.PngInfo()
    text.add_text("Title", f"{frame.product} of frame {frame.meta['frame']}")
    text.add_text("Unit", steps_of.unit)
    text.add_text("Comment", f"0 is no value; so are those beyond {_MOST_STEPS} steps")
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=1, pnginfo=text)
    return file.getvalue()


def colour_png(frame: Frame) -> bytes:
    """Return 8 bits a pixel through a palette: for eyes, not for measuring."""
    file = io.BytesIO()
    _coloured(frame).save(file, format="PNG", compress_level=1)
    return file.getvalue()


def colour_jpeg(frame: Frame) -> bytes:
    """Return the same as JPEG, which is smaller."""
    file = io.BytesIO()
    _coloured(frame).convert("RGB").save(file, "JPEG", quality=_JPEG_QUALITY)
    return file.getvalue()


def _coloured(frame: Frame) -> "Image":
    from PIL import Image  # as above

    low, high = _colour_range(frame)
    with np.errstate(invalid="ignore"):  # NaN becomes index 0 below
        index = 1.0 + 254.0 * np.clip((frame.array - low) / max(high - low, 1e-30), 0.0, 1.0)
    image = Image.fromarray(np.nan_to_num(index, nan=0.0).astype(np.uint8), mode="P")
    image.putpalette(palette())
    return image


def _colour_range(frame: Frame) -> tuple[float, float]:
    if frame.unit == "m":
        # the same colours in every frame: the unambiguous range
        return 0.0, 299_792_458.0 / (2.0 * frame.meta["base_frequency_hz"])
    finite = frame.array[np.isfinite(frame.array)]
    return (0.0, float(np.percentile(finite, 99.5))) if finite.size else (0.0, 1.0)
