"""Products as bytes: msgpack, npy and PNG. Runs on workers."""

import io
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam import wire
from transientcam_server import problem_kinds as kinds
from transientcam_server.errors import Problem
from transientcam_server.products import Product

_Array = NDArray[Any]
_Encode = Callable[[Product, _Array, Mapping[str, Any], Mapping[str, Any], int | None], bytes]


@dataclass(frozen=True, slots=True)
class Encoding:
    """A way to write a product: its name (also the suffix of a path) and media type.

    ``beside`` names products of the same frame that the writer finds in ``extra``.
    """

    name: str
    media_type: str
    encode: _Encode
    images_only: bool = False
    beside: tuple[str, ...] = ()

    def fits(self, product: Product) -> bool:
        """Whether the product can be written so."""
        return product.png_scale is not None or not self.images_only


def _msgpack(
    product: Product,
    array: _Array,
    meta: Mapping[str, Any],
    extra: Mapping[str, Any],
    channel: int | None,
) -> bytes:
    begin_s = time.perf_counter()
    # brought into its travelling form here, so that the time of it can travel along
    array = np.asarray(array, dtype=product.description.dtype, order="C")
    return wire.encode_frame(
        product=product.name,
        unit=product.description.unit,
        axes=product.description.axes,
        meta=meta,
        array=array,
        encode_s=time.perf_counter() - begin_s,
        channel=channel,
        extra=extra,
    )


def _npy(product: Product, array: _Array, *_: Any) -> bytes:
    file = io.BytesIO()
    # stored as the contract says, also where the computation worked in another type
    np.save(file, np.asarray(array, dtype=product.description.dtype), allow_pickle=False)
    return file.getvalue()


def _png(product: Product, array: _Array, *_: Any) -> bytes:
    """16 bits a pixel: steps of `Product.png_unit`; 0 where there is no value."""
    from PIL import Image  # 60 ms that the first frame need not wait for

    assert product.png_scale is not None  # noqa: S101 - `Encoding.fits` was asked
    steps = np.nan_to_num(np.asarray(array, dtype=np.float64) * product.png_scale, posinf=65535.0)
    image = Image.fromarray(np.clip(np.rint(steps), 0, 65535).astype(np.uint16))
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=1)
    return file.getvalue()


def _colour_png(
    product: Product,
    array: _Array,
    meta: Mapping[str, Any],
    *_: Any,
) -> bytes:
    """8 bits a pixel through a palette: for eyes, not for measuring."""
    from PIL import Image  # as above

    low, high = _colour_range(product, array, meta)
    with np.errstate(invalid="ignore"):  # NaN becomes index 0 below
        index = 1.0 + 254.0 * np.clip((array - low) / max(high - low, 1e-30), 0.0, 1.0)
    image = Image.fromarray(np.nan_to_num(index, nan=0.0).astype(np.uint8), mode="P")
    image.putpalette(_palette())
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=1)
    return file.getvalue()


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


MSGPACK: Final = Encoding("msgpack", wire.MEDIA_TYPE, _msgpack)
NPY: Final = Encoding("npy", "application/x-npy", _npy)
PNG: Final = Encoding("png", "image/png", _png, images_only=True)
COLOUR_PNG: Final = Encoding("colour-png", "image/png", _colour_png, images_only=True)
ENCODINGS: Final = {encoding.name: encoding for encoding in (MSGPACK, NPY, PNG)}
"""What a path may end in."""

_BY_MEDIA_TYPE = {encoding.media_type: encoding for encoding in ENCODINGS.values()} | dict.fromkeys(
    wire.MEDIA_TYPE_ALIASES, MSGPACK
)


def negotiate(product: Product, *, suffix: str | None, accept: str | None) -> Encoding:
    """Return the encoding that a suffix names, else the one an Accept header likes best.

    Raises
    ------
    Problem
        ``not-acceptable``, with the list of those the product has.
    """
    supported = [encoding for encoding in ENCODINGS.values() if encoding.fits(product)]
    if suffix is not None:
        for encoding in supported:
            if encoding.name == suffix:
                return encoding
        raise _not_acceptable(product, supported, field="suffix", value=suffix)
    for media_type in _preferences(accept or "*/*"):
        liked = _matching(media_type, supported)
        if liked is not None:
            return liked
    raise _not_acceptable(product, supported, field="Accept", value=accept)


def _matching(media_type: str, supported: list[Encoding]) -> Encoding | None:
    if media_type in ("*/*", "application/*"):
        return MSGPACK
    if media_type == "image/*":
        return PNG if PNG in supported else None
    encoding = _BY_MEDIA_TYPE.get(media_type)
    return encoding if encoding in supported else None


def _preferences(accept: str) -> list[str]:
    """Return the media types of an Accept header, best first (RFC 9110, Sec. 12.5.1)."""
    weighted = []
    for item in accept.lower().split(","):
        media_type, *parameters = (part.strip() for part in item.split(";"))
        quality = 1.0
        for parameter in parameters:
            if parameter.startswith("q="):
                try:
                    quality = float(parameter[2:])
                except ValueError:
                    quality = 0.0
        if media_type and quality > 0.0:
            weighted.append((quality, media_type))
    return [media_type for _, media_type in sorted(weighted, key=lambda each: -each[0])]


def _not_acceptable(
    product: Product, supported: list[Encoding], *, field: str, value: object
) -> Problem:
    names = [encoding.name for encoding in supported]
    return Problem(
        kinds.NOT_ACCEPTABLE,
        f"{product.name} is not available in this format, but as {', '.join(names)}.",
        field=field,
        value=value,
        supported=names,
        media_types=[encoding.media_type for encoding in supported],
    )
