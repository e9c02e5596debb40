"""The plug-in ``usb``: a camera that speaks docs/usb-protocol.md."""

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras.open_usb._camera import UsbCamera
from transientcam_driver.cameras.open_usb._transport import SameCamera, list_cameras
from transientcam_driver.clock import Clock


def _open(name: CameraName, clock: Clock) -> Camera:
    wanted = name.address or None
    return UsbCamera(SameCamera(wanted), clock=clock)


def _find() -> tuple[FoundCamera, ...]:
    return list_cameras()


PLUGIN = CameraPlugin(
    summary="a camera on USB (docs/usb-protocol.md)",
    usage="usb[:SERIAL], usb:@BUS-PORTS",
    open=_open,
    find=_find,
)
