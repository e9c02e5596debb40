"""A camera that speaks docs/usb-protocol.md.

`protocol` is its bytes. `UsbCamera` is its driver, over a transport on libusb.
"""

from transientcam_driver.cameras.open_usb._camera import UsbCamera
from transientcam_driver.cameras.open_usb._transport import (
    UDEV_RULE,
    VENDOR_IN,
    VENDOR_OUT,
    claim,
    devices,
    first_of,
    forget,
    give_back,
    list_cameras,
    node_of,
    open_transport,
    read_bulk,
    serial_of,
    system_libusb,
    translated,
    udev_rule,
)
