"""The simulated camera as a pyusb backend.

``usb.core.find(backend=...)`` finds it, and everything above pyusb is the code that drives a
real camera. Errors carry the numbers of pyusb's libusb backend.
"""

# pyright: reportIncompatibleMethodOverride=false
# (pyusb's base class has no annotations, so that its empty methods are inferred to return None)

import array
import errno
import struct
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, TypeVar

import usb.backend
from usb.core import USBError, USBTimeoutError

from transientcam_simulation.emulated._open_usb import descriptors
from transientcam_simulation.emulated._open_usb.usb_device import (
    EmulatedDevice,
    Overflow,
    Stall,
    Unplugged,
)

Result = TypeVar("Result")


def _words(text: str) -> list[str]:
    return text.split()


_DEVICE_FIELDS = _words(
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 "
    "idVendor idProduct bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations"
)
_CONFIGURATION_FIELDS = _words(
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration "
    "bmAttributes bMaxPower"
)
_INTERFACE_FIELDS = _words(
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass "
    "bInterfaceSubClass bInterfaceProtocol iInterface"
)
_ENDPOINT_FIELDS = _words(
    "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval"
)
_HIGH_SPEED = 3


def _error(text: str, libusb_code: int, number: int) -> USBError:
    return USBError(text, libusb_code, number)


def _no_device() -> USBError:
    return _error("No such device (it may have been disconnected)", -4, errno.ENODEV)


class _Handle:
    """An open device."""

    def __init__(self, device: EmulatedDevice) -> None:
        self.device = device
        self.address = device.address
        self.claimed: set[int] = set()


class SimulatedBus(usb.backend.IBackend):  # type: ignore[misc]  # pyusb has no types
    """A pyusb backend on which only simulated cameras are plugged in."""

    def __init__(self, devices: list[EmulatedDevice]) -> None:
        super().__init__()
        self._devices = devices
        self._claims: dict[tuple[int, int], _Handle] = {}

    # --- enumeration ----------------------------------------------------------------------

    def enumerate_devices(self) -> Iterator[EmulatedDevice]:
        """Yield what is plugged in."""
        return (device for device in self._devices if device.plugged)

    def get_parent(self, dev: EmulatedDevice) -> None:
        """Return None: there is no hub."""

    def get_device_descriptor(self, dev: EmulatedDevice) -> SimpleNamespace:
        """Device descriptor, with the place on the bus, which pyusb expects beside it."""
        found = _named(_DEVICE_FIELDS, "<BBHBBBBHHHBBBB", descriptors.DEVICE_DESCRIPTOR)
        found.bus, found.address = dev.bus, dev.address
        found.port_number, found.port_numbers, found.speed = 1, (1,), _HIGH_SPEED
        return found

    def get_configuration_descriptor(self, dev: EmulatedDevice, config: int) -> SimpleNamespace:
        """Return the only configuration."""
        _only(config)
        return _named(_CONFIGURATION_FIELDS, "<BBHBBBBB", descriptors.CONFIGURATION_DESCRIPTOR[:9])

    def get_interface_descriptor(
        self, dev: EmulatedDevice, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        """Return the only interface."""
        _only(intf, alt, config)
        return _named(_INTERFACE_FIELDS, "<9B", descriptors.CONFIGURATION_DESCRIPTOR[9:18])

    def get_endpoint_descriptor(
        self, dev: EmulatedDevice, ep: int, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        """Return the only endpoint."""
        _only(ep, intf, alt, config)
        found = _named(_ENDPOINT_FIELDS, "<BBBBHB", descriptors.CONFIGURATION_DESCRIPTOR[18:25])
        found.bRefresh = found.bSynchAddress = 0
        return found

    # --- opening --------------------------------------------------------------------------

    def open_device(self, dev: EmulatedDevice) -> _Handle:
        """Open; several handles may be open."""
        if not dev.plugged:
            raise _no_device()
        return _Handle(dev)

    def close_device(self, dev_handle: _Handle) -> None:
        """Close, and release what was claimed."""
        for interface in tuple(dev_handle.claimed):
            self._release(dev_handle, interface)

    def claim_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Claim for one handle; EBUSY for a second."""
        self._require_live(dev_handle)
        key = (id(dev_handle.device), intf)
        if self._claims.setdefault(key, dev_handle) is not dev_handle:
            raise _error("Resource busy", -6, errno.EBUSY)
        dev_handle.claimed.add(intf)

    def release_interface(self, dev_handle: _Handle, intf: int) -> None:
        """Release the interface."""
        self._release(dev_handle, intf)
        self._require_live(dev_handle)

    def set_configuration(self, dev_handle: _Handle, config_value: int) -> None:
        """SET_CONFIGURATION."""
        self._control(dev_handle, 0x00, 9, config_value)

    def get_configuration(self, dev_handle: _Handle) -> int:
        """GET_CONFIGURATION."""
        return self._control(dev_handle, 0x80, 8, 0)[0]

    def set_interface_altsetting(self, dev_handle: _Handle, intf: int, altsetting: int) -> None:
        """SET_INTERFACE."""
        self._control(dev_handle, 0x01, 11, altsetting)

    def clear_halt(self, dev_handle: _Handle, ep: int) -> None:
        """Let a halted endpoint run again."""
        self._require_live(dev_handle)
        dev_handle.device.clear_halt()

    def reset_device(self, dev_handle: _Handle) -> None:
        """Reset the port."""
        self._translated(dev_handle, dev_handle.device.reset)

    def is_kernel_driver_active(self, dev_handle: _Handle, intf: int) -> bool:
        """Return false: a vendor class has no kernel driver."""
        return False

    # --- transfers ------------------------------------------------------------------------

    def ctrl_transfer(
        self,
        dev_handle: _Handle,
        bmRequestType: int,
        bRequest: int,
        wValue: int,
        wIndex: int,
        data: "array.array[int]",
        timeout: int,
    ) -> int:
        """Control transfer; data to the host is written into ``data``."""
        to_host = bool(bmRequestType & 0x80)
        sent = b"" if to_host else data.tobytes()
        answer = self._translated(
            dev_handle,
            lambda: dev_handle.device.control(
                bmRequestType, bRequest, wValue, wIndex, len(data), sent
            ),
        )
        if not to_host:
            return len(sent)
        memoryview(data).cast("B")[: len(answer)] = answer
        return len(answer)

    def bulk_read(
        self, dev_handle: _Handle, ep: int, intf: int, buff: "array.array[int]", timeout: int
    ) -> int:
        """Read one transfer; ``timeout`` in ms, 0 for none."""
        if intf not in dev_handle.claimed:
            raise _error("Entity not found", -5, errno.ENOENT)
        view = memoryview(buff).cast("B")
        timeout_s = timeout / 1e3 if timeout else None
        count = self._translated(
            dev_handle, lambda: dev_handle.device.bulk_in(view, timeout_s=timeout_s)
        )
        if count == 0:
            raise USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
        return count

    # --- private --------------------------------------------------------------------------

    def _control(self, handle: _Handle, request_type: int, request: int, value: int) -> bytes:
        return self._translated(
            handle, lambda: handle.device.control(request_type, request, value, 0, 64, b"")
        )

    def _translated(self, handle: _Handle, action: Callable[[], Result]) -> Result:
        self._require_live(handle)
        try:
            return action()
        except Stall:
            raise _error("Pipe error", -9, errno.EPIPE) from None
        except Overflow:
            raise _error("Overflow", -8, errno.EOVERFLOW) from None
        except Unplugged:
            raise _no_device() from None

    def _require_live(self, handle: _Handle) -> None:
        # a handle is invalid once the cable was out, also when the camera is plugged in again
        if not handle.device.plugged or handle.address != handle.device.address:
            raise _no_device()

    def _release(self, handle: _Handle, interface: int) -> None:
        handle.claimed.discard(interface)
        key = (id(handle.device), interface)
        if self._claims.get(key) is handle:
            del self._claims[key]


def _named(names: list[str], layout: str, data: bytes) -> SimpleNamespace:
    fields: dict[str, Any] = dict(zip(names, struct.unpack(layout, data), strict=True))
    return SimpleNamespace(**fields, extra_descriptors=[])


def _only(*indices: int) -> None:
    """Refuse every index but 0: pyusb counts until IndexError."""
    if any(indices):
        raise IndexError(indices)
