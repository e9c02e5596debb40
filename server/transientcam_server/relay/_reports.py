"""What a relay reports: the way of a frame, what was missed, and the status of the camera."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from transientcam.documents import FrameMeta
from transientcam_driver import Status
from transientcam_driver.camera import DeviceState, Hop, StatusFlag

_LOST_AT_ORIGIN = "the origin has lost its camera: "
_FLAGS = {
    "light_on": StatusFlag.LIGHT_ON,
    "interlock_closed": StatusFlag.INTERLOCK_CLOSED,
    "watchdog_tripped": StatusFlag.WATCHDOG_TRIPPED,
}


@dataclass(slots=True)
class RelayCounters:
    """What happened between an origin and its relay since that was opened: see `OriginDocument`."""

    missed_frames: int = 0
    dropped_frames: int = 0
    reconnects: int = 0
    restarts: int = 0


def hops_of(
    meta: FrameMeta, *, service_id: str, now_unix_s: float, missed_frames: int
) -> tuple[Hop, ...]:
    """Return the relays that a frame has come through, this one last."""
    before = tuple(
        Hop(str(hop["service_id"]), float(hop["latency_s"]), int(hop["missed_frames"]))
        for hop in meta.get("hops", ())
    )
    left_s = meta["host_time_s"] + sum(hop.latency_s for hop in before)
    return (*before, Hop(service_id, now_unix_s - left_s, missed_frames))


def lost_at_origin(reason: object) -> str:
    """Return why the camera was lost, once, however many relays say so of the one before."""
    last = str(reason).rpartition(_LOST_AT_ORIGIN)[2]
    return _LOST_AT_ORIGIN + last.removeprefix("the camera was lost: ")


def status_of(document: Mapping[str, Any], *, epoch: int) -> Status:
    """Return the status that ``GET /camera`` of an origin has, with the epoch of this relay."""
    flags = StatusFlag(0)
    for name, flag in _FLAGS.items():
        if document[name]:
            flags |= flag
    return Status(
        state=DeviceState[str(document["state"]).upper()],
        flags=flags,
        epoch=epoch,
        next_image=int(document["next_image"]),
        device_time_s=float(document["device_time_s"]),
        dropped_images=int(document["dropped_images"]),
        fifo_bytes=int(document["fifo_bytes"]),
        fifo_high_water_bytes=int(document["fifo_high_water_bytes"]),
        temperature_c=document["temperature_c"],
    )
