"""USB descriptors of the camera, as bytes (USB 2.0 chapter 9, Microsoft OS 2.0 descriptors).

The Microsoft descriptors make Windows load WinUSB without a driver file.
"""

import struct

from transientcam_driver.cameras.open_usb.protocol import (
    IMAGE_ENDPOINT,
    PRODUCT_ID,
    VENDOR_CLASS,
    VENDOR_ID,
)

MAX_PACKET_BYTES = 512  # bulk endpoint at high speed
MS_OS_20_REQUEST = 0x20
MS_OS_20_DESCRIPTOR_INDEX = 7

DEVICE, CONFIGURATION, STRING, INTERFACE, ENDPOINT, QUALIFIER, BOS = 1, 2, 3, 4, 5, 6, 15

_MANUFACTURER, _PRODUCT, _SERIAL = 1, 2, 3
_WINDOWS_8_1 = 0x06030000
_MS_OS_20_UUID = bytes.fromhex("DF60DDD88945C74C9CD2659D9E648A9F")
_INTERFACE_GUID = "{5B8A3C8E-2D7B-4E57-9D2C-61D0C6A3F0B4}"

DEVICE_DESCRIPTOR = struct.pack(
    "<BBHBBBBHHHBBBB", 18, DEVICE,
    0x0210,  # bcdUSB: a BOS descriptor exists
    0, 0, 0,  # class of each interface
    64, VENDOR_ID, PRODUCT_ID, 0x0100, _MANUFACTURER, _PRODUCT, _SERIAL, 1,
)  # fmt: skip

_ENDPOINT_DESCRIPTOR = struct.pack("<BBBBHB", 7, ENDPOINT, IMAGE_ENDPOINT, 2, MAX_PACKET_BYTES, 0)
_INTERFACE_DESCRIPTOR = struct.pack("<BBBBBBBBB", 9, INTERFACE, 0, 0, 1, VENDOR_CLASS, 0, 0, 0)
_BELOW = _INTERFACE_DESCRIPTOR + _ENDPOINT_DESCRIPTOR
CONFIGURATION_DESCRIPTOR = (
    struct.pack("<BBHBBBBB", 9, CONFIGURATION, 9 + len(_BELOW), 1, 1, 0, 0x80, 250) + _BELOW
)


def _ms_os_20() -> bytes:
    compatible = struct.pack("<HH8s8s", 20, 3, b"WINUSB", b"")
    name = "DeviceInterfaceGUIDs\0".encode("utf-16-le")
    value = f"{_INTERFACE_GUID}\0\0".encode("utf-16-le")
    multi_string = 7
    registry = struct.pack("<HHHH", 10 + len(name) + len(value), 4, multi_string, len(name))
    registry += name + struct.pack("<H", len(value)) + value
    header = struct.pack("<HHIH", 10, 0, _WINDOWS_8_1, 10 + len(compatible) + len(registry))
    return header + compatible + registry


MS_OS_20_DESCRIPTOR = _ms_os_20()


def _bos() -> bytes:
    link_power_management = 0x02  # "shall be set" (USB 3.2, 9.6.2.1)
    usb_20_extension = struct.pack("<BBBI", 7, 0x10, 2, link_power_management)
    microsoft = struct.pack("<BBBx16s", 28, 0x10, 5, _MS_OS_20_UUID)
    microsoft += struct.pack("<IHBB", _WINDOWS_8_1, len(MS_OS_20_DESCRIPTOR), MS_OS_20_REQUEST, 0)
    below = usb_20_extension + microsoft
    return struct.pack("<BBHB", 5, BOS, 5 + len(below), 2) + below


BOS_DESCRIPTOR = _bos()


def string_descriptors(*, product: str, serial: str) -> dict[int, bytes]:
    """Return the string descriptors by index; index 0 lists the languages (US English)."""

    def encoded(text: str) -> bytes:
        utf16 = text.encode("utf-16-le")[:252]
        return bytes([2 + len(utf16), STRING]) + utf16

    return {
        0: struct.pack("<BBH", 4, STRING, 0x0409),
        _MANUFACTURER: encoded("transientcam"),
        _PRODUCT: encoded(product),
        _SERIAL: encoded(serial),
    }
