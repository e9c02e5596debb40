"""Whether a camera delivers the rate it states: what depends on it cannot be tried otherwise."""

from dataclasses import dataclass
from typing import Final

from transientcam_conformance._device import Device

_FRAMES: Final = 10
KEPT_SHARE: Final = 0.7
"""Share of the stated rate from which it counts as kept."""


@dataclass(frozen=True, slots=True)
class Rate:
    """Frames a second that arrive, and that the sequence states."""

    delivered_hz: float
    stated_hz: float

    @property
    def kept(self) -> bool:
        """Whether about as many arrive as are stated."""
        return self.delivered_hz >= KEPT_SHARE * self.stated_hz

    def __str__(self) -> str:
        """As in "the camera does not keep its rate: 2.1 of 10.6 frames/s arrive"."""
        keeps = "keeps" if self.kept else "does not keep"
        rates = f"{self.delivered_hz:.3g} of {self.stated_hz:.3g} frames/s arrive"
        return f"the camera {keeps} its rate: {rates}"

    def to_document(self) -> dict[str, float]:
        """Return it as a map."""
        return {"delivered_hz": self.delivered_hz, "stated_hz": self.stated_hz}


def measured_rate(device: Device) -> Rate:
    """Stream frames of one small product, and count those that come in the time of the camera.

    Raises PromiseBroken if none come.
    """
    with device.capturing(), device.stream("flags") as stream:
        stated_hz = float(device.sequence["frame_rate_hz"])
        times_s = [float(stream.frame().meta["host_time_s"]) for _ in range(_FRAMES)]
    elapsed_s = times_s[-1] - times_s[0]
    delivered_hz = (_FRAMES - 1) / elapsed_s if elapsed_s > 0 else stated_hz
    return Rate(delivered_hz, stated_hz)
