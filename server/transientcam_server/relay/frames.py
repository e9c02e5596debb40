"""What is subscribed to at an origin, and the captures that its messages are made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam import Frame
from transientcam_driver import ProtocolError, RawFrame
from transientcam_server.imaging.moment_frame import OF_IMAGES, MomentFrame

RAW: Final = "raw"
MOMENTS: Final = "measured_moments"
SUBSCRIBED: Final[dict[str, tuple[str, ...]]] = {RAW: (RAW,), MOMENTS: (MOMENTS, "flags")}
"""What can be relayed, each with the products of the origin that it takes."""
Parts = Mapping[str, Frame]
"""Products of one frame by their names."""


@dataclass(slots=True)
class Collector:
    """Collects the products of a frame, which come one after the other.

    Attributes
    ----------
    products
        Names of all of them.
    """

    products: tuple[str, ...]
    _number: int | None = None
    _parts: dict[str, Frame] = field(default_factory=dict)

    def add(self, part: Frame) -> Parts | None:
        """Take a message, and return the products of its frame once all are there.

        Where the origin could not compute one of them, the others of its frame are dropped.
        """
        if part.frame != self._number:
            self._number, self._parts = part.frame, {}
        self._parts[part.product] = part
        return self._parts if len(self._parts) == len(self.products) else None


def capture_of(parts: Parts, *, height: int, width: int, moments: int, **given: Any) -> RawFrame:
    """Return the capture that products of a frame are of.

    Parameters
    ----------
    height, width
        Of the images.
    moments
        How many there are, b_0 included.
    given
        All other fields of the capture; `labels` of as many images as there are.

    Raises
    ------
    ProtocolError
        An array has another shape or type.
    """
    if RAW in parts:
        images = _checked(parts[RAW], (len(given["labels"]), height, width), np.uint16)
        return RawFrame(images=images, **given)
    flags = _checked(parts["flags"], (height, width), np.uint8)
    return MomentFrame(
        images=np.empty((0, height, width), np.uint16),
        moments=_checked(parts[MOMENTS], (moments, height, width), np.complex64),
        saturated=(flags & np.uint8(tm.Flags.SATURATED)) > 0,
        treated={name: parts[MOMENTS].meta[name] for name in OF_IMAGES},
        **given,
    )


def _checked(part: Frame, shape: tuple[int, ...], dtype: type[np.generic]) -> Any:
    found = part.array
    if found.shape != shape or found.dtype != dtype:
        expected = f"{np.dtype(dtype)} {shape} expected"
        raise ProtocolError(f"{part.product} {found.dtype} {found.shape}, {expected}")
    return found
