"""One product of one frame: a numpy array with its unit, axes and metadata."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from transientcam.documents import FrameMeta
from transientcam.errors import ParameterError
from transientcam.notebook import map_html, table_html


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Frame:
    """One product of one frame; numpy functions take it as the array it holds.

    Attributes
    ----------
    product
        Its name: ``range``, ``coefficients`` and so on.
    unit
        Of the values: ``m``, ``DN``, ``DN/s`` or ``1``; ``s,DN`` where planes take turns.
    axes
        Name of each axis of `array`, slowest first; pixels are ``y``, ``x``.
    meta
        Metadata of the frame: its number, times, sequence, lost images, pixel counts; and the
        ``region`` and ``decimation`` of its pixels.
    array
        The values, read-only; NaN where a pixel has none.
    encode_s
        How long the server took to make this product and its bytes.
    channel
        The subscription of a stream that it belongs to; None outside a stream.
    extra
        Parts of some products: ``labels`` of raw, ``time_s`` of those over time, ``y`` of
        streak, ``radius`` of bounds, ``intrinsics`` of pointcloud.
    """

    product: str
    unit: str
    axes: tuple[str, ...]
    meta: FrameMeta
    array: NDArray[Any]
    encode_s: float = 0.0
    channel: int | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def frame(self) -> int:
        """Number of the frame, counted by the server from 1; products of one frame share it."""
        return int(self.meta["frame"])

    @property
    def time_s(self) -> NDArray[np.float64] | None:
        """Times of flight along the axis ``time``, (T,), or None where there is no such axis."""
        times = self.extra.get("time_s")
        return None if times is None else np.asarray(times, dtype=np.float64)

    @property
    def labels(self) -> Sequence[Mapping[str, Any]]:
        """Label of each image of ``raw``, in the order of its first axis; empty otherwise."""
        return tuple(self.extra.get("labels", ()))

    @property
    def frequencies_hz(self) -> Sequence[float]:
        """Modulation frequency of each plane of moments, 0 for b_0; empty otherwise."""
        return tuple(self.extra.get("frequencies_hz", ()))

    @property
    def points(self) -> NDArray[np.float32]:
        """The points (N, 3) of a ``pointcloud`` that have a range, in m, row by row.

        Raises
        ------
        ParameterError
            If it is another product.
        """
        if self.product != "pointcloud":
            raise ParameterError("product", self.product, "pointcloud")
        flat = self.array.reshape(3, -1)
        points: NDArray[np.float32] = flat[:, np.isfinite(flat[2])].T.copy()
        return points

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.array, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        shape = " x ".join(str(length) for length in self.array.shape)
        return f"<Frame {self.frame} {self.product} [{shape}] {self._values()}>"

    def _repr_html_(self) -> str:
        """Return an image as a map with its scale, another product as a table, for notebooks."""
        if self.array.ndim == 2 and self.array.dtype.kind != "c" and self.axes == ("y", "x"):
            return map_html(self.array, title=f"{self.product}, frame {self.frame}", unit=self.unit)
        lengths = dict(zip(self.axes, self.array.shape, strict=True))
        return table_html(repr(self), {"unit": self.unit, **lengths})

    def _values(self) -> str:
        if self.array.dtype.kind == "c":
            return f"complex {self.unit}"
        finite = self.array[np.isfinite(self.array)]
        if finite.size == 0:
            return f"no value, {self.unit}"
        without = self.array.size - finite.size
        gaps = f", {without / self.array.size:.1%} without" if without else ""
        return f"{finite.min():.4g} to {finite.max():.4g} {self.unit}{gaps}"


def npy_bytes(frame: Frame) -> bytes:
    """Return the array of a frame as an .npy file."""
    file = io.BytesIO()
    np.save(file, frame.array, allow_pickle=False)
    return file.getvalue()


def npz_bytes(frame: Frame) -> bytes:
    """Return a frame and its metadata as an .npz file, which `numpy.load` reads.

    It holds ``array``, ``product``, ``unit``, ``axes``, ``meta`` (JSON) and the parts that only
    some products have: numbers and arrays as arrays (``time_s``), all else as JSON (``labels``).
    """
    parts: dict[str, Any] = {
        "array": frame.array,
        "product": frame.product,
        "unit": frame.unit,
        "axes": np.array(frame.axes),
        "meta": json.dumps(dict(frame.meta)),
        **{name: _part(value) for name, value in frame.extra.items()},
    }
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **parts)
    return file.getvalue()


def _part(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value
    numbers = value if isinstance(value, list) else [value]
    if all(isinstance(each, int | float) for each in numbers):
        return np.asarray(value)
    return json.dumps(value)
