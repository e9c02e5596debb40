"""The plug-in ``kinect2``: a Microsoft Kinect v2 on USB 3, or its emulation."""

import time
from collections.abc import Iterator
from contextlib import closing, suppress
from typing import Any, Final, get_args

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras.kinect2 import (
    LEAST_TRANSFERS,
    PRODUCT,
    ROWS,
    TRANSFERS,
    Kinect2,
    Kinect2Camera,
    Rows,
    SameKinect,
    facts,
    list_kinects,
)
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraError
from transientcam_simulation.emulated import build_kinect2
from transientcam_simulation.entries.emulated import (
    EMULATED,
    OF_EMULATION,
    require_no_emulation,
    simulated_scene,
)

_EMULATED_SILENCE_S: Final = 60.0
"""An emulated camera may compute for seconds what a scene looks like."""
_SCENE: Final = "corner"
"""Of an emulated camera: two returns in a pixel, as many as three frequencies can separate."""
_OPTIONS: Final = {
    "rows": "top or bottom: from where the camera counts its principal point (docs/cameras.md)",
    "transfers": f"isochronous transfers in flight, a millisecond each; {TRANSFERS} without it",
}


def _rows(name: CameraName) -> Rows:
    chosen: Any = name.choice("rows", get_args(Rows))
    rows: Rows = chosen
    return rows


def _open(name: CameraName, clock: Clock) -> Camera:
    rows = _rows(name)
    if name.address != EMULATED:
        return Kinect2Camera(_real(name), rows=rows, clock=clock)
    scene = simulated_scene(name, _SCENE)
    emulated, simulation = build_kinect2(scene.load(), seed=scene.seed, clock=clock)
    return Kinect2Camera(
        lambda serial: Kinect2(emulated.connect(), pause=time.sleep, serial=serial),
        rows=rows,
        clock=clock,
        simulation=simulation,
        silence_s=_EMULATED_SILENCE_S,
    )


def _real(name: CameraName) -> SameKinect:
    require_no_emulation(name)
    return SameKinect(name.address or None, pause=time.sleep, transfers=_transfers(name))


def _transfers(name: CameraName) -> int:
    return name.integer("transfers", TRANSFERS, least=LEAST_TRANSFERS, most=1000)


def _check(name: CameraName) -> None:
    _rows(name)
    _transfers(name)
    if name.address == EMULATED:
        simulated_scene(name, _SCENE).load()
    else:
        require_no_emulation(name)


def _find() -> Iterator[FoundCamera]:
    yield FoundCamera(f"kinect2:{EMULATED}", product=PRODUCT, simulated=True)
    with suppress(CameraError):  # without libusb there are none; doctor says so
        yield from list_kinects()


def _facts(name: CameraName) -> Iterator[tuple[str, str]]:
    """Read what the maintainer of this driver needs to know of a real camera."""
    rows = _rows(name)
    yield "rows", ROWS[rows]
    if name.address != EMULATED:
        with closing(_real(name)()) as kinect:
            yield from facts(kinect)


PLUGIN: Final = CameraPlugin(
    summary="a Microsoft Kinect v2 on USB 3, or its emulation (docs/cameras.md)",
    usage=f"kinect2[:SERIAL], kinect2:@BUS-PORTS or kinect2:{EMULATED}",
    open=_open,
    find=_find,
    check=_check,
    facts=_facts,
    options={**_OPTIONS, **OF_EMULATION, "scene": f"of the emulation, {_SCENE} without it"},
)
