"""A camera that speaks docs/usb-protocol.md.

`protocol` is its bytes. `UsbCamera` is its driver, over a transport on libusb.
"""

from transientcam_driver.cameras.open_usb._camera import UsbCamera
from transientcam_driver.cameras.open_usb._transport import (
    UDEV_RULE,
    VENDOR_IN,
    VENDOR_OUT,
    claim,
    give_back,
    list_cameras,
    node_of,
    open_transport,
    plugged,
    read_bulk,
    system_libusb,
    translated,
    udev_rule,
)
