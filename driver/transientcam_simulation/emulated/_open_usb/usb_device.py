"""The simulated camera as a USB device: standard requests, one bulk endpoint, faults, a cable.

A mount (a pyusb backend, a usbfs server) only passes requests and transfers on to it.
"""

import math
import struct
import threading
from collections.abc import Callable
from enum import IntEnum

from transientcam_driver.camera import Capabilities
from transientcam_driver.cameras.open_usb.protocol import Request
from transientcam_driver.clock import Clock
from transientcam_simulation.emulated._open_usb import descriptors
from transientcam_simulation.emulated._open_usb.faults import Fault, FaultyCable
from transientcam_simulation.emulated._open_usb.firmware import Firmware, Refusal

_STANDARD, _VENDOR, _TYPE_MASK, _DEVICE_TO_HOST = 0x00, 0x40, 0x60, 0x80
_TO_ENDPOINT = 0x02
_FOREVER_S = 3600.0  # one wait of a read without a time limit, which then waits again
_INTERRUPTS_THE_STREAM = {Request.START, Request.COMMIT, Request.FLUSH}


class _Standard(IntEnum):
    """bRequest of the standard requests (USB 2.0, table 9-4)."""

    GET_STATUS = 0
    CLEAR_FEATURE = 1
    GET_DESCRIPTOR = 6
    GET_CONFIGURATION = 8
    SET_CONFIGURATION = 9
    GET_INTERFACE = 10
    SET_INTERFACE = 11


class Stall(Exception):  # noqa: N818  (the bus's own term)
    """The endpoint answers with a stall."""


class Overflow(Exception):  # noqa: N818  (the bus's own term)
    """A packet does not fit into what is left of the host's buffer."""


class Unplugged(Exception):  # noqa: N818  (a state, not an error)
    """The device is not plugged in any more."""


class EmulatedDevice:
    """One camera on an emulated bus.

    Every method may be called from any thread. Rendering happens on the thread that reads.
    """

    def __init__(
        self, capabilities: Capabilities, power_on: Callable[[float], Firmware], *, clock: Clock
    ) -> None:
        self.changed = threading.Condition()
        self.clock = clock
        self.bus, self.address = 1, 1
        self.plugged = True
        self.strings = descriptors.string_descriptors(
            product=capabilities.model, serial=capabilities.serial
        )
        self._power_on = power_on
        self._halted = False
        self._cable = FaultyCable()
        self._left_over = memoryview(b"")
        self._requests_to_stall = 0
        self._silent_until_s = -math.inf
        self._configuration = 1
        self._firmware = power_on(clock.now_s())

    # --- control endpoint -----------------------------------------------------------------

    def control(
        self, request_type: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> bytes:
        """Execute a control transfer; return at most ``length`` bytes, empty for writes."""
        with self.changed:
            if not self.plugged:
                raise Unplugged
            kind = request_type & _TYPE_MASK
            if kind == _VENDOR:
                return self._vendor(request_type, request, value, index, data)[:length]
            if kind == _STANDARD:
                return self._standard(request_type, request, value)[:length]
            raise Stall

    def _vendor(
        self, request_type: int, request: int, value: int, index: int, data: bytes
    ) -> bytes:
        if (
            request == descriptors.MS_OS_20_REQUEST
            and index == descriptors.MS_OS_20_DESCRIPTOR_INDEX
        ):
            return descriptors.MS_OS_20_DESCRIPTOR
        if self._requests_to_stall and request != Request.SAFE_OFF:  # usb-protocol 9: never refused
            self._requests_to_stall -= 1
            raise Stall
        try:
            now_s, answer = self.clock.now_s(), b""
            if request_type & _DEVICE_TO_HOST:
                answer = self._firmware.control_in(request, value, index, now_s=now_s)
            else:
                self._firmware.control_out(request, data, now_s=now_s)
            self._firmware.resume(self.clock.now_s())
            return answer
        except Refusal as refusal:
            raise Stall from refusal
        finally:
            if request in _INTERRUPTS_THE_STREAM:
                self._clear_transfers()
            self.changed.notify_all()  # a read in progress may have another image to wait for

    def _standard(self, request_type: int, request: int, value: int) -> bytes:
        match request:
            case _Standard.GET_DESCRIPTOR:
                return self._descriptor(value >> 8, value & 0xFF)
            case _Standard.GET_STATUS:
                to_endpoint = request_type & 0x1F == _TO_ENDPOINT
                return struct.pack("<H", self._halted and to_endpoint)
            case _Standard.GET_CONFIGURATION:
                return bytes([self._configuration])
            case _Standard.GET_INTERFACE:
                return b"\0"
            case _Standard.CLEAR_FEATURE:
                self._halted = False
            case _Standard.SET_CONFIGURATION:
                self._configuration = value
            case _Standard.SET_INTERFACE:
                pass
            case _:
                raise Stall
        return b""

    def _descriptor(self, kind: int, index: int) -> bytes:
        if kind == descriptors.STRING and index in self.strings:
            return self.strings[index]
        known = {
            descriptors.DEVICE: descriptors.DEVICE_DESCRIPTOR,
            descriptors.CONFIGURATION: descriptors.CONFIGURATION_DESCRIPTOR,
            descriptors.BOS: descriptors.BOS_DESCRIPTOR,
        }
        if kind not in known:
            raise Stall
        return known[kind]

    # --- bulk endpoint --------------------------------------------------------------------

    def bulk_in(self, buffer: memoryview, *, timeout_s: float | None) -> int:
        """Fill ``buffer`` from the next image; wait until it is due, at most ``timeout_s``.

        Returns the number of bytes, 0 when the time ran out.
        """
        with self.changed:
            address = self.address
            end_s = None if timeout_s is None else self.clock.now_s() + timeout_s
            while (data := self.take(len(buffer))) is None:
                now_s = self.clock.now_s()
                if end_s is not None and now_s >= end_s:
                    return 0
                self._firmware.prepare()
                due_s = self.due_s()
                times_s = [time_s for time_s in (due_s, end_s) if time_s is not None]
                wait_s = min(times_s) - self.clock.now_s() if times_s else _FOREVER_S
                self.clock.wait(self.changed, max(0.0, wait_s))
                if self.address != address:  # pulled out and plugged in again meanwhile
                    raise Unplugged
            buffer[: len(data)] = data
            return len(data)

    def take(self, most: int) -> memoryview | None:
        """Take one transfer of at most ``most`` bytes, or None if nothing is there yet.

        The caller holds ``changed``. Each image ends with a short packet, so that a transfer
        never holds more than one.
        """
        if not self.plugged:
            raise Unplugged
        if self._halted:
            raise Stall
        if self.clock.now_s() < self._silent_until_s:
            return None
        if not self._left_over:
            while not self._cable:
                packet = self._firmware.read(now_s=self.clock.now_s())
                if packet is None:
                    return None
                self._cable.carry(packet)
            transfer = self._cable.take()
            if transfer is None:
                raise Overflow
            self._left_over = memoryview(transfer)
        if len(self._left_over) > most and most % descriptors.MAX_PACKET_BYTES:
            self._left_over = memoryview(b"")
            raise Overflow
        data, self._left_over = self._left_over[:most], self._left_over[most:]
        return data

    def due_s(self) -> float | None:
        """When the next image can be read; None as long as none is being made."""
        now_s = self.clock.now_s()
        due_s = now_s if self._left_over or self._cable else self._firmware.due_s()
        return None if due_s is None else max(due_s, self._silent_until_s)

    def clear_halt(self) -> None:
        """Clear the halt of the bulk endpoint."""
        with self.changed:
            self._halted = False
            self.changed.notify_all()

    def reset(self) -> None:
        """Port reset: the device starts again, at the same address."""
        with self.changed:
            if not self.plugged:
                raise Unplugged
            self._restart()

    # --- cable and faults -----------------------------------------------------------------

    def unplug(self) -> None:
        """Pull the cable, and with it the power."""
        with self.changed:
            self.plugged = False
            self.changed.notify_all()

    def replug(self) -> None:
        """Plug the cable in again: power-up, and a new address. No effect on a plugged device."""
        with self.changed:
            if not self.plugged:
                self.plugged = True
                self.address = self.address % 127 + 1
                self._restart()

    def halt(self) -> None:
        """Halt the bulk endpoint, as a device does that cannot continue."""
        with self.changed:
            self._halted = True
            self.changed.notify_all()

    def inject(self, fault: Fault, images: int = 1) -> None:
        """Inject a fault into the next images."""
        with self.changed:
            self._cable.inject(fault, images)

    def stall_next(self, requests: int = 1) -> None:
        """Stall the next vendor requests of any kind but SAFE_OFF."""
        with self.changed:
            self._requests_to_stall += requests

    def fall_silent(self, duration_s: float) -> None:
        """Send no image for some time."""
        with self.changed:
            self._silent_until_s = self.clock.now_s() + duration_s
            self.changed.notify_all()

    def set_interlock(self, *, closed: bool) -> None:
        """Open or close the safety interlock."""
        with self.changed:
            self._firmware.set_interlock(self.clock.now_s(), closed=closed)
            self.changed.notify_all()

    def _clear_transfers(self) -> None:
        self._cable.clear()
        self._left_over = memoryview(b"")

    def _restart(self) -> None:
        self._halted = False
        self._clear_transfers()
        self._cable = FaultyCable()
        self._requests_to_stall = 0
        self._silent_until_s = -math.inf
        self._configuration = 1
        self._firmware = self._power_on(self.clock.now_s())
        self.changed.notify_all()
