"""The formats that products are answered in, and which of them a request wants.

Their writers run on workers.
"""

import io
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from transientcam import Frame, wire
from transientcam.frame import npz_bytes
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
    meta = cast("wire.FrameMeta", meta)
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
