"""The formats that products are answered in, and which of them a request wants.

Their writers run on workers.
"""

import io
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam import Frame, wire
from transientcam.frame import npz_bytes
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.encodings import files, pictures
from transientcam_server.imaging.products import Product

_Array = NDArray[Any]
_Encode = Callable[[Product, _Array, Mapping[str, Any], Mapping[str, Any], int | None], bytes]


@dataclass(frozen=True, slots=True)
class Encoding:
    """A way to write a product: its name (also the suffix of a path) and media type.

    ``fits`` says whether a product can be written so. ``beside`` names products of the same frame
    that the writer finds in ``extra``. ``slow`` is one that takes as long as much computing.
    """

    name: str
    media_type: str
    encode: _Encode
    fits: Callable[[Product], bool] = lambda product: True
    beside: tuple[str, ...] = ()
    slow: bool = False


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


def _npz(
    product: Product, array: _Array, meta: Mapping[str, Any], extra: Mapping[str, Any], *_: Any
) -> bytes:
    description = product.description
    array = np.asarray(array, dtype=description.dtype)
    return npz_bytes(
        Frame(product.name, description.unit, description.axes, meta, array, extra=extra)
    )


def _is_image(product: Product) -> bool:
    return product.png_scale is not None


def _is_real(product: Product) -> bool:
    return np.dtype(product.description.dtype).kind != "c"


def _is_cloud(product: Product) -> bool:
    return product.name == "pointcloud"


MSGPACK: Final = Encoding("msgpack", wire.MEDIA_TYPE, _msgpack)
NPY: Final = Encoding("npy", "application/x-npy", _npy)
NPZ: Final = Encoding("npz", "application/x-npz", _npz)
PNG: Final = Encoding("png", "image/png", pictures.png, _is_image)
COLOUR_PNG: Final = Encoding("colour-png", "image/png", pictures.colour_png, _is_image)
COLOUR_JPEG: Final = Encoding("colour-jpeg", "image/jpeg", pictures.colour_jpeg, _is_image)
TIFF: Final = Encoding("tiff", "image/tiff", files.tiff, _is_real)
PLY: Final = Encoding(
    "ply", "application/x-ply", files.ply, _is_cloud, ("range", "direct", "flags")
)
CSV: Final = Encoding("csv", "text/csv", files.csv, _is_image, slow=True)
ENCODINGS: Final = {each.name: each for each in (MSGPACK, NPY, NPZ, PNG, TIFF, PLY, CSV)}
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
        return next((each for each in (PNG, TIFF) if each in supported), None)
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
