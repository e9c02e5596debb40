"""The plug-in ``usb``: a camera that speaks docs/usb-protocol.md."""

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras.open_usb._camera import UsbCamera
from transientcam_driver.cameras.open_usb._transport import list_cameras, open_transport
from transientcam_driver.clock import Clock


def _open(name: CameraName, clock: Clock) -> Camera:
    wanted = name.address or None
    return UsbCamera(lambda serial: open_transport(serial or wanted), clock=clock)


def _find() -> tuple[FoundCamera, ...]:
    return list_cameras()


PLUGIN = CameraPlugin(
    summary="a camera on USB (docs/usb-protocol.md)", usage="usb[:SERIAL]", open=_open, find=_find
)
