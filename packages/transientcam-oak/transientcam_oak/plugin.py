"""The plug-in ``oak``: a time-of-flight camera of Luxonis, on USB or a network."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any, Final

from transientcam_driver import Camera, CameraName, CameraPlugin, FoundCamera, FreeRunningCamera
from transientcam_driver.clock import Clock
from transientcam_oak import Oak

FPS: Final = 30.0


def _open(name: CameraName, clock: Clock) -> Camera:
    fps = name.number("fps", FPS, least=4.0, most=160.0)
    return FreeRunningCamera(lambda: Oak(name.address, fps=fps), clock=clock)


def _find() -> Iterator[FoundCamera]:
    try:
        depthai: Any = import_module("depthai")
    except ImportError:  # `Oak` says so
        return
    for each in depthai.Device.getAllAvailableDevices():
        serial = each.getDeviceId()
        yield FoundCamera(f"oak:{serial}", serial=serial, product="OAK", node=each.name)


PLUGIN: Final = CameraPlugin(
    summary="a time-of-flight camera of Luxonis, by depthai (two frequencies: no separation)",
    usage="oak: or oak:ID, an IP address or a USB port",
    open=_open,
    find=_find,
    options={"fps": f"raw images a second, four of which make a frame; {FPS:g} without it"},
)
