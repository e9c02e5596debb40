"""The contract of all cameras, for every plug-in of this distribution."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest

import transientcam
from tests.driver.cameras.kinect2.standing import READ_S, camera_of, emulated
from tests.driver.mounts import PyusbMount
from tests.opt8241 import standing as opt8241
from tests.server.recording.made import record
from tests.serving import serving
from transientcam_driver import Camera, TriggeredCamera, open_camera
from transientcam_driver.camera import kinds
from transientcam_driver.cameras.tofcam660 import DeviceOptions, Region, Tofcam660
from transientcam_driver.clock import RealClock, VirtualClock
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractSkipped
from transientcam_server.relay import Origin, RelayCamera
from transientcam_simulation.emulated import Fault, build_tofcam660, find_scene, without_noise

SKIPPED = {
    "recording": {
        "a-new-sequence-has-a-new-epoch": "it can do no other sequence",
        "lost-images-are-counted": "nothing here can lose image",
        "an-unplugged-camera-is-lost-and-comes-back": "nothing here can unplug",
    }
}


def simulated(directory: Path, closing: ExitStack) -> Bench:
    return Bench(partial(open_camera, "sim:wall?noise=off", clock=VirtualClock(start_s=1.0)))


def on_usb(directory: Path, closing: ExitStack) -> Bench:
    mount = PyusbMount()
    closing.callback(mount.restore)

    def do(command: str, *arguments: object) -> None:
        mount.do(command, *arguments)

    def lit(camera: Camera) -> bool:
        return False if not mount._device.plugged else mount.lit

    return Bench(
        mount.open,
        lit=lit,
        unplug=lambda camera: do("unplug"),
        replug=lambda camera: do("replug"),
        lose_image=lambda camera: do("inject", "drop", 1),
    )


def recorded(directory: Path, closing: ExitStack) -> Bench:
    path = record(directory / "a.h5", 4)
    return Bench(partial(open_camera, f"recording:{path}?speed=fast&loop=on"))


def emulated_tofcam660(directory: Path, closing: ExitStack) -> Bench:
    device, simulation = build_tofcam660(
        without_noise(find_scene("wall")), seed=1, clock=RealClock()
    )
    closing.callback(device.close)
    options = DeviceOptions(
        settle_s=0.0,
        image_s=0.2,
        region=Region(152, 112, 168, 128),
        control_port=device.control_port,
        data_port=device.data_port,
    )
    return Bench(
        lambda: TriggeredCamera(lambda: Tofcam660(device.host, options)),
        unplug=lambda camera: device.unplug(),
        replug=lambda camera: device.replug(),
        lose_image=lambda camera: simulation.drop_next(),
    )


def emulated_kinect2(directory: Path, closing: ExitStack) -> Bench:
    device = emulated()
    return Bench(
        lambda: camera_of(device),
        lit=lambda camera: device.lit,
        unplug=lambda camera: device.unplug(),
        replug=lambda camera: device.replug(),
        lose_image=lambda camera: device.inject(Fault.DROP),
        read_s=READ_S,
    )


def emulated_opt8241(directory: Path, closing: ExitStack) -> Bench:
    clock = VirtualClock(start_s=1.0)
    device = opt8241.emulated(clock=clock)
    return Bench(
        lambda: opt8241.camera_of(device, clock=clock),
        lit=lambda camera: device.lit,
        unplug=lambda camera: device.unplug(),
        replug=lambda camera: device.replug(),
        lose_image=lambda camera: device.inject(Fault.CORRUPT_PIXELS),
    )


def relayed(directory: Path, closing: ExitStack) -> Bench:
    """An origin that captures nothing: what a relay switches on there is its own."""
    origin = closing.enter_context(serving("sim:wall?noise=off"))
    camera = closing.enter_context(transientcam.Camera(origin.url, timeout_s=60.0))
    origin.start_all_workers()
    camera.latest(wait_s=10.0)
    camera.stop()

    def lit(relay: Camera) -> bool:
        status = camera.camera["status"]
        return status is not None and bool(status["light_on"])

    def cause(fault: str) -> Callable[[Camera], None]:
        def at_the_origin(relay: Camera) -> None:
            camera.cause(fault)

        return at_the_origin

    return Bench(
        lambda: RelayCamera(Origin(origin.url, None, timeout_s=60.0)),
        lit=lit,
        unplug=cause("unplug"),
        replug=cause("replug"),
        lose_image=cause("drop-image"),
    )


BENCHES = {
    "relay": relayed,
    "kinect2": emulated_kinect2,
    "opt8241": emulated_opt8241,
    "tofcam660": emulated_tofcam660,
    "sim": simulated,
    "usb": on_usb,
    "recording": recorded,
}


@pytest.fixture(scope="module", params=sorted(BENCHES))
def bench(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[str, Bench]]:
    with ExitStack() as closing:
        yield request.param, BENCHES[request.param](tmp_path_factory.mktemp("bench"), closing)


@pytest.mark.parametrize("clause", CLAUSES, ids=lambda each: each.name)
def test_every_kind_of_camera_keeps_the_contract(bench: tuple[str, Bench], clause: Clause) -> None:
    kind, camera = bench
    skipped = SKIPPED.get(kind, {}).get(clause.name)
    if skipped is None:
        clause.run(camera)
    else:
        with pytest.raises(ContractSkipped, match=skipped):
            clause.run(camera)


def test_no_kind_is_left_out() -> None:
    assert set(kinds()) - {"oak"} == set(BENCHES)  # which has tests of its own
