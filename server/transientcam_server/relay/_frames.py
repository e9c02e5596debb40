"""What is subscribed to at an origin, and the captures that its messages are made of."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam import Frame
from transientcam_driver import AppliedSequence, Capabilities, ProtocolError, RawFrame
from transientcam_driver.camera import Hop
from transientcam_server.imaging import OF_IMAGES, MomentFrame

RAW: Final = "raw"
MOMENTS: Final = "measured_moments"
SUBSCRIBED: Final[dict[str, tuple[str, ...]]] = {RAW: (RAW,), MOMENTS: (MOMENTS, "flags")}
"""What can be relayed, each with the products of the origin that it takes."""
_AS_THERE: Final = ("device_time_s", "host_time_s", "capture_s", "temperature_c")
Parts = Mapping[str, Frame]
"""Products of one frame by their names."""


@dataclass(slots=True)
class Collector:
    """Collects the products of a frame, which come one after the other."""

    products: tuple[str, ...]
    """Names of all of them."""
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


def capture_of(
    parts: Parts,
    applied: AppliedSequence,
    capabilities: Capabilities,
    *,
    number: int,
    lost_images: int,
    hops: tuple[Hop, ...],
) -> RawFrame:
    """Return the capture that products of a frame are of.

    ``applied``, ``capabilities``: sequence and camera, by which arrays have a shape.
    ``number``, ``lost_images``, ``hops``: of the capture; the rest is as the origin states it.
    Raises ProtocolError where an array has another shape or type.
    """
    meta = next(iter(parts.values())).meta
    pixels = capabilities.height, capabilities.width
    as_there: dict[str, Any] = {name: meta[name] for name in _AS_THERE}
    given = as_there | {
        "captured_unix_s": meta.get("captured_unix_s"),
        "number": number,
        "epoch": applied.epoch,
        "labels": applied.labels,
        "lost_images": lost_images,
        "hops": hops,
    }
    if RAW in parts:
        images = _checked(parts[RAW], (applied.images, *pixels), np.uint16)
        return RawFrame(images=images, **given)
    moments = 1 + applied.sequence.harmonics
    flags = _checked(parts["flags"], pixels, np.uint8)
    return MomentFrame(
        images=np.empty((0, *pixels), np.uint16),
        moments=_checked(parts[MOMENTS], (moments, *pixels), np.complex64),
        saturated=(flags & np.uint8(tm.Flags.SATURATED)) > 0,
        treated={name: meta[name] for name in OF_IMAGES},
        ambient_dn=meta.get("ambient_dn") or 0.0,
        **given,
    )


def _checked(part: Frame, shape: tuple[int, ...], dtype: type[np.generic]) -> Any:
    found = part.array
    if found.shape != shape or found.dtype != dtype:
        expected = f"{np.dtype(dtype)} {shape} expected"
        raise ProtocolError(f"{part.product} {found.dtype} {found.shape}, {expected}")
    return found
