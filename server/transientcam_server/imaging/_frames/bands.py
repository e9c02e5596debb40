"""Products over time in bands: computed while they are sent, and never whole in memory.

A band is some times of flight of all pixels that are requested. The data of an array are in C
order with time before the pixels, so bands one after another are the array.
"""

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product as combinations
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam.documents import FrameMeta
from transientcam.wire import array_head, frame_document
from transientcam_driver import AppliedSequence
from transientcam_server.imaging._encodings.encoding import MSGPACK, NPY, Encoding
from transientcam_server.imaging._products.products import Product
from transientcam_server.imaging._products.view import View
from transientcam_server.imaging._recipe.recipe import Recipe

BAND_BYTES: Final = 1024 * 1024
"""Of data that are computed at once."""
STREAMED_BYTES: Final = 4 * BAND_BYTES
"""Products with more data than this are sent in bands."""
_ENCODINGS: Final = (MSGPACK, NPY)


@dataclass(frozen=True, slots=True)
class Band:
    """A part of a product: these of its first axes, at these times."""

    leading: tuple[int, ...]
    view: View

    def of(self, array: NDArray[Any], dtype: str) -> bytes:
        """Return the data of the band from what was computed for its view."""
        return np.asarray(array[self.leading], dtype=dtype, order="C").tobytes()


@dataclass(frozen=True, slots=True)
class Banded:
    """How a product is sent in bands."""

    product: Product
    encoding: Encoding
    view: View
    shape: tuple[int, ...]
    """Of the whole array."""
    bands: tuple[Band, ...]
    """In the order in which they are sent."""

    @property
    def data_bytes(self) -> int:
        """Size of the array."""
        return math.prod(self.shape) * np.dtype(self.product.description.dtype).itemsize

    def head(self, meta: FrameMeta, extra: dict[str, Any]) -> bytes:
        """Return what is sent before the data."""
        dtype = self.product.description.dtype
        if self.encoding is NPY:
            file = io.BytesIO()
            header = {"descr": dtype, "fortran_order": False, "shape": self.shape}
            np.lib.format.write_array_header_1_0(file, header)
            return file.getvalue()
        described = self.product.description
        document = frame_document(
            product=self.product.name,
            unit=described.unit,
            axes=described.axes,
            meta=meta,
            extra=extra,
        )
        return array_head(document, dtype, self.shape, self.data_bytes)


def banded(
    product: Product,
    encoding: Encoding,
    view: View,
    *,
    applied: AppliedSequence,
    height: int,
    width: int,
) -> Banded | None:
    """Return how a product is sent in bands; None if it is sent whole."""
    size_bytes = size_of(product, view, applied=applied, height=height, width=width)
    if encoding not in _ENCODINGS or size_bytes <= STREAMED_BYTES:
        return None
    rows, columns = view.crop.shape(height, width)
    shape = product.shape(applied, rows, columns, times=len(view.time_s))
    bands = tuple(_bands(product, view, shape, size_bytes))
    return Banded(product, encoding, view, shape, bands)


def size_of(
    product: Product, view: View, *, applied: AppliedSequence, height: int, width: int
) -> int:
    """Return the bytes of a product over time; 0 of any other, which has no such measure."""
    if not product.over_time:
        return 0
    rows, columns = view.crop.shape(height, width)
    shape = product.shape(applied, rows, columns, times=len(view.time_s))
    return math.prod(shape) * np.dtype(product.description.dtype).itemsize


def computed(
    product: Product, recipe: Recipe, given: Any, view: View, *, height: int, width: int
) -> NDArray[Any]:
    """Return a product, in bands where it is large: computing takes several times its memory."""
    applied = recipe.applied
    size_bytes = size_of(product, view, applied=applied, height=height, width=width)
    if size_bytes <= STREAMED_BYTES:
        return product.compute(recipe, given, view)
    rows, columns = view.crop.shape(height, width)
    shape = product.shape(applied, rows, columns, times=len(view.time_s))
    whole = np.empty(shape, product.description.dtype)
    axis = product.description.axes.index("time")
    count = max(1, BAND_BYTES * shape[axis] // size_bytes)
    for first in range(0, shape[axis], count):
        part = replace(view, time_s=view.time_s[first : first + count])
        at = (slice(None),) * axis + (slice(first, first + count),)
        whole[at] = product.compute(recipe, given, part)
    return whole


def _bands(product: Product, view: View, shape: tuple[int, ...], size_bytes: int) -> Iterator[Band]:
    axis = product.description.axes.index("time")
    of_one_time = size_bytes // shape[axis]
    count = max(1, BAND_BYTES // of_one_time)
    for leading in combinations(*map(range, shape[:axis])):
        for first in range(0, shape[axis], count):
            yield Band(leading, replace(view, time_s=view.time_s[first : first + count]))
