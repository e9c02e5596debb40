"""The sensor and the cable of an emulated OPT8241-CDK."""

from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.clock import Clock
from transientcam_opt8241 import Request
from transientcam_opt8241.emulated._firmware import EmulatedRegisters
from transientcam_simulation.emulated import ZERO_DN, Fault, PluggedCamera

_SHORT_BY: Final = 512
_BITS: Final = 0xFFF


class Pixels(Protocol):
    """What the sensor sees."""

    def differences(
        self, frequency_hz: float, exposure_s: float, *, delay_s: float, device_time_s: float
    ) -> NDArray[np.uint16]:
        """Return the images (quads, 240, 320) of a frame."""
        ...

    def temperature_c(self, device_time_s: float) -> float:
        """Temperature of the sensor."""
        ...


class EmulatedOpt8241(PluggedCamera["EmulatedLink"]):
    """An emulated camera, and its cable; a fault lets a frame come short, as none has a number.

    Frames come at the pace that its registers set, or later where they take longer to make. The
    first one after each start is still the last one before it.

    ``pixels``: what its frames show.
    ``serial``: its serial number.
    ``clock``: paces its frames.
    """

    def __init__(self, pixels: Pixels, *, serial: str, clock: Clock) -> None:
        super().__init__("opt8241:emulated", "OPT8241-CDK")
        self._pixels = pixels
        self._clock = clock
        self._since_s = clock.now_s()
        self.serial = serial
        self._power_on()

    def _power_on(self) -> None:
        self.registers = EmulatedRegisters()
        self._due_s: float | None = None
        self._stale = b""
        self._last = bytes(2 * self.registers.quads * 240 * 320)

    @property
    def lit(self) -> bool:
        """Whether the light is on."""
        return self.plugged and self.registers.running

    def _new_link(self) -> "EmulatedLink":
        return EmulatedLink(self)

    # --- at the other end of a link ----------------------------------------------------------

    def write(self, request: int, value: int, index: int, data: bytes) -> None:
        """Take a request, under the lock; it may start or stop the sensor."""
        was_running = self.registers.running
        self.registers.write(request, value, index, data)
        if self.registers.running != was_running:
            self._due_s = None if was_running else self._clock.now_s() + self.registers.frame_s
            self._stale = b"" if was_running else self._last
            self.changed.notify_all()

    def frame(self, link: "EmulatedLink", timeout_s: float) -> bytes | None:
        """Wait for the next frame."""
        with self.changed:
            end_s = self._clock.now_s() + timeout_s
            while not self._is_due(end_s):
                self.require(link)
                if self._clock.now_s() >= end_s:
                    return None
            self.require(link)
            stale, self._stale = self._stale, b""
            faults = () if stale else (Fault.DROP, Fault.CORRUPT_PIXELS)
            short = any(self._faults.take(each) for each in faults)
            modulation = self.registers.modulation_hz, self.registers.exposure_s
        if not stale:
            self._last = self._made(*modulation)
        made = stale or self._last
        return made[:-_SHORT_BY] if short else made

    def _is_due(self, end_s: float) -> bool:
        """Wait for a frame, a change or the end; return whether there is a frame, and take it."""
        now_s = self._clock.now_s()
        due_s = self._due_s if self.registers.gives_raw_quads else None
        if due_s is None or due_s > now_s:
            until_s = end_s if due_s is None else min(due_s, end_s)
            if until_s > now_s:
                self._clock.wait(self.changed, until_s - now_s)
            return False
        self._due_s = max(now_s, due_s + self.registers.frame_s)
        return True

    def _made(self, frequency_hz: float, exposure_s: float) -> bytes:
        time_s = self._clock.now_s() - self._since_s
        images = self._pixels.differences(
            frequency_hz, exposure_s, delay_s=0.0, device_time_s=time_s
        )
        with self.changed:
            self.registers.set_temperature(self._pixels.temperature_c(time_s))
        signed = images.astype(np.int32) - ZERO_DN
        return (signed & _BITS).astype("<u2").transpose(1, 2, 0).tobytes()


class EmulatedLink:
    """One opening of an emulated camera: `opt8241.link.Link` without a cable."""

    node = ""

    def __init__(self, plug: EmulatedOpt8241) -> None:
        self._plug = plug
        self.serial = plug.serial

    def control_in(self, request: Request, value: int, index: int, length: int) -> bytes:
        """Send a request and return the answer."""
        with self._plug.changed:
            self._plug.require(self)
            return self._plug.registers.read(request, value, index, length)

    def control_out(self, request: Request, value: int, index: int, data: bytes) -> None:
        """Send a request."""
        with self._plug.changed:
            self._plug.require(self)
            self._plug.write(request, value, index, data)

    def read(self, most_bytes: int, *, timeout_s: float) -> bytes | None:
        """Return the next frame."""
        frame = self._plug.frame(self, timeout_s)
        return None if frame is None else frame[:most_bytes]

    def clear_halt(self) -> None:
        """Do nothing: its endpoint never halts."""

    def close(self) -> None:
        """Give the camera back."""
        self._plug.release(self)
