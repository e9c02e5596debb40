"""Stand-ins for what a unit under test is handed: frames without a camera."""

from types import SimpleNamespace
from typing import cast

from transientcam import wire
from transientcam_server.broadcast import Channel
from transientcam_server.imaging import PRODUCTS, Frame


def fake_frame(number: int, *, device_time_s: float | None = None, lost_images: int = 0) -> Frame:
    """A frame that knows its number and time, which is all that a hub needs."""
    time_s = number / 10.0 if device_time_s is None else device_time_s
    raw = SimpleNamespace(device_time_s=time_s, lost_images=lost_images)
    return cast("Frame", SimpleNamespace(number=number, raw=raw))


def channel(
    product: str = "range", *, max_rate_hz: float | None = None, number: int = 0
) -> Channel:
    """A channel of one product."""
    return Channel(number, PRODUCTS[product], max_rate_hz)


NOTICE = wire.Notice("camera-lost", {"reason": "unplugged"})
