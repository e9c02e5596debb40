"""Status and clock of the device: GET_STATUS (usb-protocol 6) and GET_TIME (3)."""

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from transientcam_driver.errors import ProtocolError
from transientcam_driver.protocol.requests import VERSION
from transientcam_driver.protocol.units import centidegrees, nanoseconds


class DeviceState(IntEnum):
    """State of the device (usb-protocol 2)."""

    IDLE = 0
    STREAMING = 1
    FAULTED = 2


class StatusFlag(IntFlag):
    """Flags of GET_STATUS."""

    LIGHT_ON = 1
    INTERLOCK_CLOSED = 2
    WATCHDOG_TRIPPED = 4
    SEQUENCE_STAGED = 8


@dataclass(frozen=True, slots=True)
class Status:
    """Answer to GET_STATUS.

    ``next_image`` is the sequence number of the next image, ``dropped_images`` the number that the
    device's FIFO had no room for since power-up.
    """

    state: DeviceState
    flags: StatusFlag
    epoch: int
    next_image: int
    device_time_s: float
    dropped_images: int
    fifo_bytes: int
    fifo_high_water_bytes: int
    temperature_c: float

    _LAYOUT = struct.Struct("<BBHIQQIIIhxx")
    BYTES = _LAYOUT.size

    @classmethod
    def of_host(
        cls,
        *,
        streaming: bool,
        light_on: bool,
        epoch: int,
        next_image: int,
        device_time_s: float,
        temperature_c: float,
    ) -> "Status":
        """Return the status of a camera without watchdog, interlock and FIFO of its own."""
        flags = StatusFlag.INTERLOCK_CLOSED
        return cls(
            state=DeviceState.STREAMING if streaming else DeviceState.IDLE,
            flags=flags | StatusFlag.LIGHT_ON if light_on else flags,
            epoch=epoch,
            next_image=next_image,
            device_time_s=device_time_s,
            dropped_images=0,
            fifo_bytes=0,
            fifo_high_water_bytes=0,
            temperature_c=temperature_c,
        )

    @property
    def light_on(self) -> bool:
        """Whether the light source is enabled."""
        return StatusFlag.LIGHT_ON in self.flags

    @property
    def interlock_closed(self) -> bool:
        """Whether the safety interlock allows the light."""
        return StatusFlag.INTERLOCK_CLOSED in self.flags

    @property
    def watchdog_tripped(self) -> bool:
        """Whether the light went off because no heartbeat came (usb-protocol 3.2)."""
        return StatusFlag.WATCHDOG_TRIPPED in self.flags

    def pack(self) -> bytes:
        """Bytes of the answer."""
        return self._LAYOUT.pack(
            VERSION,
            self.state,
            self.flags,
            self.epoch,
            self.next_image,
            nanoseconds(self.device_time_s),
            self.dropped_images,
            self.fifo_bytes,
            self.fifo_high_water_bytes,
            centidegrees(self.temperature_c),
        )

    @classmethod
    def unpack(cls, data: bytes) -> "Status":
        """Read the answer."""
        if len(data) != cls.BYTES or data[0] != VERSION:
            raise ProtocolError(f"status of {len(data)} bytes, {cls.BYTES} needed")
        _, state, flags, epoch, image, time_ns, dropped, fifo, high, centi = cls._LAYOUT.unpack(
            data
        )
        if state not in tuple(DeviceState):
            raise ProtocolError(f"status with the unknown state {state}")
        return cls(
            DeviceState(state),
            StatusFlag(flags),
            epoch,
            image,
            time_ns / 1e9,
            dropped,
            fifo,
            high,
            centi / 100,
        )


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
