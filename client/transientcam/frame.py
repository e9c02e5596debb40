"""One product of one frame: a numpy array with its unit, axes and metadata."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NotRequired, TypedDict

import numpy as np
from numpy.typing import DTypeLike, NDArray

from transientcam.errors import ParameterError
from transientcam.notebook import map_html, table_html


class PixelCounts(TypedDict):
    """Number of pixels of a frame that carry each flag; one pixel may carry several."""

    total: int
    valid: int
    biased: int
    no_signal: int
    saturated: int
    non_finite: int
    degenerate: int
    replaced: int
    contradictory: NotRequired[int]
    """More than noise explains; absent from daemons that do not look for it."""
    unexplained: NotRequired[int]
    """The returns do not explain the moments; absent from daemons that do not look for it."""


class PredictedStd(TypedDict):
    """Standard deviation of a frame's range in m between frames, by the sensor's noise.

    To first order, of the returns that the frame shows (docs/accuracy.md); the product
    ``range_std`` draws the noise.
    """

    median: float
    p90: float
    """90 % of the pixels are better."""
    first_order_share: float
    """Share of the pixels where the noise model holds; that of the others is a rough figure."""


class RangeAccuracy(TypedDict):
    """Predicted errors of a frame's range: those in m of the median pixel that has one."""

    range_error_m: float | None
    """Noise and bias together, root sum of squares; None where one frequency knows no bias."""
    range_std_m: float | None
    """Standard deviation that the sensor's noise gives."""
    range_bias_m: float | None
    """How far it is off for good, as far as the frame shows it."""
    outlier_share: float | None
    """Share of the ranges that are off by more than five times `range_error_m`; a bias that none
    of the frame's frequencies shows is not in it."""
    every_px: NotRequired[int]
    """The errors are those of one pixel in so many rows and columns."""


class RelayHop(TypedDict):
    """One relay that a frame came through (docs/relay.md)."""

    service_id: str
    latency_s: float
    """From its arrival at the service before to that at this relay, by the clocks of both."""
    missed_frames: int
    """Frames that this relay never got, since it began."""


class FrameMeta(TypedDict):
    """Metadata of a frame, the same for all its products."""

    frame: int
    """Counted by the server from 1; never resets while it runs."""
    sequence_id: int
    calibration_id: str
    reconstruction_id: int
    """Counts the settings of the reconstruction that the server has had."""
    estimator: NotRequired[str]
    """What range, direct and indirect light are taken from; absent from older daemons."""
    device_time_s: float
    """Start of the first exposure, by the camera's clock."""
    host_time_s: float
    """Arrival of the last image, Unix time."""
    capture_s: float
    reconstruct_s: float | None
    """None until a product of this frame was computed."""
    base_frequency_hz: float
    harmonics: int
    zeroth: str
    exposure_s: float
    takes: int
    width: int
    height: int
    temperature_c: float
    lost_images: int
    """Images lost or corrupt between the frame before and this one."""
    hops: NotRequired[list[RelayHop]]
    """The relays that it came through, the first one first; absent from older daemons."""
    rejected_images: int | None
    """Images left out of the average over takes as outliers; None until it was computed."""
    repaired_images: int | None
    """Images that lost their synchronisation, rebuilt from the others; None until computed."""
    unrepaired_images: int | None
    """Images of pairs that contradict the others and could not be rebuilt; None until computed."""
    filled_images: list[int] | None
    """Which images are those of the frame before, by their index in it; None until computed."""
    corrected_pixels: int | None
    """Pixels from whose moments known harmonics of the modulation were taken out; None where the
    calibration knows none, and until computed."""
    pixels: PixelCounts | None
    ambient_dn: NotRequired[float | None]
    """Light in DN an image that is not the camera's, in the median pixel; 0 where it hardly adds
    noise, None until computed and where no sensor is known; absent from older daemons."""
    predicted_range_std_m: PredictedStd | None
    """None until the range of this frame was computed."""
    accuracy: NotRequired[RangeAccuracy | None]
    """None until one of range_std, range_bias, range_error was; absent from older daemons."""
    region: list[int]
    """The pixels of the frame that the array holds: column and row of the first, width, height."""
    decimation: int
    """Every so many of them are in the array, both ways."""


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
