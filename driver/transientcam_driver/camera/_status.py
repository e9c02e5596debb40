"""How a device stands: its state, its light, its clock and its memory."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag


class DeviceState(IntEnum):
    """State of the device."""

    IDLE = 0
    STREAMING = 1
    FAULTED = 2


class StatusFlag(IntFlag):
    """What is true of a device at one time."""

    LIGHT_ON = 1
    INTERLOCK_CLOSED = 2
    WATCHDOG_TRIPPED = 4
    SEQUENCE_STAGED = 8


@dataclass(frozen=True, slots=True)
class Status:
    """How the device stands.

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
    temperature_c: float | None

    @classmethod
    def of_host(
        cls,
        *,
        streaming: bool,
        light_on: bool,
        epoch: int,
        next_image: int,
        device_time_s: float,
        temperature_c: float | None,
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
        """Whether the light went off because no heartbeat came."""
        return StatusFlag.WATCHDOG_TRIPPED in self.flags
