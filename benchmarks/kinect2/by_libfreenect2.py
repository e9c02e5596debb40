"""Have libfreenect2 itself read the emulated Kinect v2 over USB, and store what it makes of it.

The camera is a node of an emulated bus, and libusb in the other process the real one.
"""

import os
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from benchmarks.kinect2.seen import EVERY, SCENES, STORED, spec
from tests.driver.cameras.kinect2.usb3 import Usb3Mount
from tests.driver.cameras.open_usb.usbfs.processes import PRELOAD, missing_libraries
from transientcam_driver.camera import CameraName
from transientcam_driver.cameras.kinect2 import HEIGHT, WIDTH
from transientcam_driver.clock import RealClock
from transientcam_simulation.emulated import build_kinect2
from transientcam_simulation.entries.emulated import simulated_scene

_PROGRAM: Final = Path(__file__).with_name("read_frames.cpp")
_FRAMES: Final = 2


def compiled(source: Path, build: Path, folder: Path) -> Path:
    """Return the program that reads frames by the library."""
    program, libraries = folder / "read_frames", build / "lib"
    headers = [f"-I{each}" for each in (source / "include", build)]
    linked = [f"-L{libraries}", "-lfreenect2", f"-Wl,-rpath,{libraries.resolve()}"]
    command = ["g++", "-O2", "-std=c++11", str(_PROGRAM), "-o", str(program)]
    subprocess.run([*command, *headers, *linked], check=True)
    return program


def read(program: Path, scene: str, *, filters: bool) -> tuple[list[NDArray[Any]], str]:
    """Return depth in mm and infrared of the last of some equal frames, and what was printed."""
    chosen = simulated_scene(CameraName.parse(spec(scene)))
    camera, _ = build_kinect2(chosen.load(), seed=chosen.seed, clock=RealClock())
    with TemporaryDirectory(prefix="usb-", dir="/tmp") as root, TemporaryDirectory() as folder:
        mount = Usb3Mount(camera, "SIM-ideal-0", Path(root))
        environment = os.environ | {
            "UMOCKDEV_DIR": root,
            "LD_PRELOAD": PRELOAD,
            "SYSTEMD_DEVICE_VERIFY_SYSFS": "0",
            "LIBFREENECT2_LOGGER_LEVEL": "warning",
        }
        try:
            command = [str(program), folder, str(_FRAMES), str(int(filters))]
            ran = subprocess.run(
                command, env=environment, stdout=subprocess.PIPE, text=True, check=True
            )
            assert not camera.lit
        finally:
            mount.close()
        frames = [
            [
                np.fromfile(Path(folder, f"{kind}{number}"), "<f4").reshape(HEIGHT, WIDTH)
                for kind in ("depth", "ir")
            ]
            for number in range(_FRAMES)
        ]
    for one, other in zip(*frames, strict=True):
        np.testing.assert_array_equal(one, other)
    return frames[0], ran.stdout


def store(*, source: Path, build: Path) -> None:
    """Store what libfreenect2 made of all scenes, every so many pixels of it.

    ``source`` is a checkout of OpenKinect/libfreenect2, and ``build`` the folder where CMake built
    it, unchanged. It needs g++, umockdev and libusb.
    """
    if missing := missing_libraries():
        raise SystemExit(missing)
    outputs: dict[str, NDArray[Any]] = {}
    with TemporaryDirectory() as folder:
        program = compiled(source, build, Path(folder))
        for scene in SCENES:
            (depth, infrared), said = read(program, scene, filters=False)
            (filtered, _), _ = read(program, scene, filters=True)
            print(scene, *said.split())
            outputs |= {
                f"{scene}_depth_mm": depth[EVERY],
                f"{scene}_depth_mm_filtered": filtered[EVERY],
                f"{scene}_ir": infrared[EVERY],
            }
    np.savez_compressed(STORED, allow_pickle=False, **outputs)
