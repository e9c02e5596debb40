"""The contract of all cameras, for every plug-in of this distribution."""

from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import pytest

from tests.driver.kinect2.standing import READ_S, camera_of, emulated
from tests.driver.mounts import PyusbMount
from tests.server.recording.made import record
from transientcam_driver import Camera, TriggeredCamera, open_camera
from transientcam_driver.clock import RealClock, VirtualClock
from transientcam_driver.contract import CLAUSES, Bench, Clause, ContractSkipped
from transientcam_driver.opening import kinds
from transientcam_driver.simulation.build import find_scene, without_noise
from transientcam_driver.simulation.device import Fault
from transientcam_driver.simulation.tofcam660 import build_tofcam660
from transientcam_driver.tofcam660 import DeviceOptions, Region, Tofcam660

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


BENCHES = {
    "kinect2": emulated_kinect2,
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
    assert set(kinds()) == set(BENCHES)
