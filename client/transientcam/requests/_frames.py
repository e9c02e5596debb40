"""Requests for frames: which frame, which part of a product, in which format."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from transientcam.errors import ParameterError
from transientcam.frame import Frame
from transientcam.requests._request import (
    Request,
    body_of,
    document,
    query,
    recording_path,
    segment,
)
from transientcam.wire import MAX_SERVER_MESSAGE_BYTES, MEDIA_TYPE, parse_frame

FILE_TYPES: Final = {
    "png": "image/png",
    "npy": "application/x-npy",
    "npz": "application/x-npz",
    "tiff": "image/tiff",
    "ply": "application/x-ply",
    "csv": "text/csv",
}
"""Media types of the files that the daemon writes frames in, by their format."""


@dataclass(frozen=True, slots=True)
class Which:
    """Which frame: the newest, one by its ``number``, or one of a ``recording`` (from 1).

    The newest has to be newer than frame ``after``; the daemon waits up to ``wait_s`` for a frame
    that is still to come.
    """

    number: int | None = None
    recording: str | None = None
    wait_s: float | None = None
    after: int | None = None

    @property
    def path(self) -> str:
        """Its path.

        Raises ParameterError if ``number`` is below 1, or ``recording`` is no id.
        """
        if self.number is not None and self.number < 1:
            raise ParameterError("number", self.number, "from 1")
        base = "" if self.recording is None else recording_path(self.recording) + "/"
        return f"{base}frames/{'latest' if self.number is None else self.number}"

    @property
    def params(self) -> tuple[tuple[str, object], ...]:
        """Its parameters in a query."""
        return (("wait_s", self.wait_s), ("after", self.after))

    @property
    def extra_timeout_s(self) -> float:
        """How much longer than usual the answer may take."""
        return self.wait_s or 0.0


@dataclass(frozen=True, slots=True)
class Part:
    """Which part of a product: times of flight, row, region, every ``decimation``-th pixel."""

    time_s: object = None
    bins: int | None = None
    y: int | None = None
    region: Sequence[int] | None = None
    decimation: int | None = None

    @property
    def params(self) -> tuple[tuple[str, object], ...]:
        """Its parameters in a query.

        Raises ParameterError if times are not finite, or the region is not four whole numbers.
        """
        return (
            *_times(self.time_s),
            ("bins", self.bins),
            ("y", self.y),
            ("region", _region(self.region)),
            ("decimation", self.decimation),
        )


WHOLE: Final = Part()
"""The whole of a product."""


def meta(which: Which) -> Request[dict[str, Any]]:
    """Build the request for the metadata of a frame."""
    return document(which.path, params=which.params, extra_timeout_s=which.extra_timeout_s)


def frame(product: str, which: Which, part: Part = WHOLE) -> Request[Frame]:
    """Build the request for a product of a frame."""
    return Request(
        "GET",
        f"{which.path}/{segment(product)}.msgpack",
        lambda answer: parse_frame(body_of(answer, MEDIA_TYPE)),
        query((*part.params, *which.params)),
        accept=MEDIA_TYPE,
        most_bytes=MAX_SERVER_MESSAGE_BYTES,
        extra_timeout_s=which.extra_timeout_s,
    )


def file(
    product: str, form: str, which: Which, part: Part = WHOLE, *, colour: bool = False
) -> Request[bytes]:
    """Build the request for a product of a frame as a file.

    Raises ParameterError if ``form`` is none of `FILE_TYPES`.
    """
    if form not in FILE_TYPES:
        raise ParameterError("form", form, f"one of {', '.join(FILE_TYPES)}")
    media_type = FILE_TYPES[form]
    return Request(
        "GET",
        f"{which.path}/{segment(product)}.{form}",
        lambda answer: body_of(answer, media_type),
        query((("view", "colour" if colour else None), *part.params, *which.params)),
        accept=media_type,
        most_bytes=MAX_SERVER_MESSAGE_BYTES,
        extra_timeout_s=which.extra_timeout_s,
    )


def pixel(which: Which, *, x: int, y: int, bins: int | None = None) -> Request[dict[str, Any]]:
    """Build the request for everything about one pixel of a frame."""
    params = (("x", x), ("y", y), ("bins", bins), *which.params)
    return document(f"{which.path}/pixel", params=params, extra_timeout_s=which.extra_timeout_s)


def _times(time_s: object) -> Iterable[tuple[str, object]]:
    if time_s is None:
        return []
    times = np.atleast_1d(np.asarray(time_s, dtype=np.float64))
    if times.ndim != 1 or not np.isfinite(times).all():
        raise ParameterError("time_s", time_s, "finite times in seconds, in one dimension")
    return [("time_s", repr(float(time))) for time in times]


def _region(region: Sequence[int] | None) -> str | None:
    if region is None:
        return None
    numbers = list(region)
    if len(numbers) != 4 or not all(isinstance(each, int | np.integer) for each in numbers):
        raise ParameterError("region", region, "x, y, width, height in whole pixels")
    return ",".join(str(int(each)) for each in numbers)
