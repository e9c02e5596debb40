"""The plug-in ``opt8241``: a Texas Instruments OPT8241-CDK on USB, or its emulation."""

from collections.abc import Iterator
from contextlib import closing, suppress
from typing import Final

from transientcam_driver.camera import Camera, CameraName, CameraPlugin, FoundCamera
from transientcam_driver.cameras.triggered import TriggeredCamera
from transientcam_driver.clock import Clock
from transientcam_driver.errors import CameraError
from transientcam_opt8241 import PRODUCT, QUADS, Opt8241, SameCamera, list_cameras
from transientcam_opt8241.emulated import build_opt8241
from transientcam_simulation.entries.emulated import (
    EMULATED,
    OF_EMULATION,
    require_no_emulation,
    simulated_scene,
)


def _quads(name: CameraName) -> int:
    return int(name.choice("phases", map(str, QUADS)))


def _open(name: CameraName, clock: Clock) -> Camera:
    quads = _quads(name)
    if name.address != EMULATED:
        require_no_emulation(name)
        link = SameCamera(name.address or None)
        return TriggeredCamera(lambda: Opt8241(link(), quads=quads), clock=clock)
    scene = simulated_scene(name)
    emulated, simulation = build_opt8241(scene.load(), seed=scene.seed, clock=clock, quads=quads)
    return TriggeredCamera(
        lambda: Opt8241(emulated.connect(), quads=quads), clock=clock, simulation=simulation
    )


def _check(name: CameraName) -> None:
    _quads(name)
    if name.address == EMULATED:
        simulated_scene(name).load()
    else:
        require_no_emulation(name)


def _find() -> Iterator[FoundCamera]:
    yield FoundCamera(f"opt8241:{EMULATED}", product=PRODUCT, simulated=True)
    with suppress(CameraError):  # without libusb there are none; doctor says so
        yield from list_cameras()


def _facts(name: CameraName) -> Iterator[tuple[str, str]]:
    """Read what the maintainer of this driver needs to know of a real camera."""
    if name.address != EMULATED:
        link = SameCamera(name.address or None)()
        with closing(Opt8241(link, quads=_quads(name))) as device:
            yield from device.facts()


PLUGIN: Final = CameraPlugin(
    summary="a Texas Instruments OPT8241-CDK on USB, or its emulation (docs/opt8241.md)",
    usage=f"opt8241[:SERIAL], opt8241:@BUS-PORTS or opt8241:{EMULATED}",
    open=_open,
    find=_find,
    check=_check,
    facts=_facts,
    options={"phases": "4 or 6 of each frequency; 4 without it", **OF_EMULATION},
)
