"""The formats of HTTP answers. Their writers run on workers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from transientcam import Frame, wire
from transientcam.frame import npy_bytes, npz_bytes
from transientcam_server.imaging._encodings import files, pictures
from transientcam_server.imaging._products.products import Product


@dataclass(frozen=True, slots=True)
class Encoding:
    """A way to write a product: its name (also the suffix of a path) and media type.

    ``encode`` takes a frame whose array has the type of the contract and holds the pixels that are
    requested. ``fits`` tests whether a product can be written so. ``beside`` names products of the
    same frame that the writer finds in ``extra``. ``slow`` is one that takes as long as much
    computing. ``archive`` is one that also holds what an archive of a product has.
    """

    name: str
    media_type: str
    encode: Callable[[Frame], bytes]
    fits: Callable[[Product], bool] = lambda product: True
    beside: tuple[str, ...] = ()
    slow: bool = False
    archive: bool = False


def message(frame: Frame) -> bytes:
    """Return a frame as a message of docs/stream.md, which is also the answer of ``.msgpack``."""
    return wire.encode_frame(
        product=frame.product,
        unit=frame.unit,
        axes=frame.axes,
        meta=frame.meta,
        array=frame.array,
        encode_s=frame.encode_s,
        channel=frame.channel,
        extra=frame.extra,
    )


def _is_image(product: Product) -> bool:
    return product.png_steps is not None


def _is_real(product: Product) -> bool:
    return np.dtype(product.description.dtype).kind != "c"


def _is_cloud(product: Product) -> bool:
    return product.name == "pointcloud"


MSGPACK: Final = Encoding("msgpack", wire.MEDIA_TYPE, message)
NPY: Final = Encoding("npy", "application/x-npy", npy_bytes)
NPZ: Final = Encoding("npz", "application/x-npz", npz_bytes, archive=True)
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
