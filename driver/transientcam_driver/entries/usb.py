"""The plug-in ``usb``: a camera that speaks docs/usb-protocol.md."""

from transientcam_driver.camera import Camera
from transientcam_driver.clock import Clock
from transientcam_driver.plugin import CameraName, CameraPlugin, FoundCamera
from transientcam_driver.usb import list_cameras, open_transport
from transientcam_driver.usb_camera import UsbCamera


def _open(name: CameraName, clock: Clock) -> Camera:
    wanted = name.address or None
    return UsbCamera(lambda serial: open_transport(serial or wanted), clock=clock)


def _find() -> tuple[FoundCamera, ...]:
    return list_cameras()


PLUGIN = CameraPlugin(
    summary="a camera on USB (docs/usb-protocol.md)", usage="usb[:SERIAL]", open=_open, find=_find
)
