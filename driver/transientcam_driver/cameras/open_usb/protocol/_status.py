"""Status and clock of the device: GET_STATUS (usb-protocol 6) and GET_TIME (3)."""

import struct

from transientcam_driver.camera import DeviceState, Status, StatusFlag
from transientcam_driver.cameras.open_usb.protocol._requests import VERSION
from transientcam_driver.cameras.open_usb.protocol._units import centidegrees, nanoseconds
from transientcam_driver.errors import ProtocolError

_STATUS = struct.Struct("<BBHIQQIIIhxx")
STATUS_BYTES = _STATUS.size


def pack_status(status: Status) -> bytes:
    """Answer to GET_STATUS (usb-protocol 6)."""
    return _STATUS.pack(
        VERSION, status.state, status.flags, status.epoch, status.next_image,
        nanoseconds(status.device_time_s), status.dropped_images, status.fifo_bytes,
        status.fifo_high_water_bytes, centidegrees(status.temperature_c or 0.0),
    )  # fmt: skip


def unpack_status(data: bytes) -> Status:
    """Read the answer to GET_STATUS.

    Raises ProtocolError where it has another length or version, or a state that the protocol does
    not know.
    """
    if len(data) != STATUS_BYTES or data[0] != VERSION:
        raise ProtocolError(f"status of {len(data)} bytes, {STATUS_BYTES} needed")
    _, state, flags, epoch, image, time_ns, dropped, fifo, high, centi = _STATUS.unpack(data)
    if state not in tuple(DeviceState):
        raise ProtocolError(f"status with the unknown state {state}")
    return Status(
        DeviceState(state), StatusFlag(flags), epoch, image, time_ns / 1e9, dropped, fifo, high,
        centi / 100,
    )  # fmt: skip


_TIME = struct.Struct("<Q")
TIME_BYTES = _TIME.size


def pack_time(device_time_s: float) -> bytes:
    """Answer to GET_TIME: nanoseconds since power-up."""
    return _TIME.pack(nanoseconds(device_time_s))


def unpack_time(data: bytes) -> float:
    """Read the answer to GET_TIME, in seconds."""
    if len(data) != TIME_BYTES:
        raise ProtocolError(f"time of {len(data)} bytes, {TIME_BYTES} needed")
    return float(_TIME.unpack(data)[0] / 1e9)
