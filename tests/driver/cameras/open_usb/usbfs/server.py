"""An emulated camera as a process: ``server.py ROOT [KIND]``; commands come on standard input.

A command is a JSON list: what to do, and its arguments.
"""

import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.driver.cameras.kinect2 import standing as kinects
from tests.driver.cameras.kinect2.usb3 import Usb3Mount
from tests.driver.cameras.open_usb.usbfs.usbfs import UsbfsMount
from tests.opt8241 import standing as opt8241s
from tests.opt8241.usb2 import OnBus, Usb2Mount
from transientcam_driver.camera import Status
from transientcam_driver.cameras.open_usb.protocol import Request, unpack_status
from transientcam_driver.clock import RealClock
from transientcam_simulation.emulated import build, find_scene, without_noise
from transientcam_simulation.emulated._open_usb import EmulatedDevice
from transientcam_simulation.emulated._open_usb.faults import Fault


class Slow(RealClock):
    """A tenth of real time: frames of 2.7 MB thirty times a second would take a whole core."""

    def now_s(self) -> float:
        return super().now_s() / 10

    def wait(self, condition: threading.Condition, timeout_s: float) -> None:
        super().wait(condition, timeout_s * 10)


class Prototype:
    """The open USB camera, and what can happen to it."""

    def __init__(self, root: Path) -> None:
        scene = without_noise(find_scene("wall"))
        self.device: EmulatedDevice
        self.device, _ = build(scene, width=163, height=120, seed=1, clock=RealClock())
        self.mount = UsbfsMount(self.device, root)

    def stall(self, requests: int) -> None:
        with self.device.changed:
            self.device._requests_to_stall = requests

    def status(self) -> Status:
        with self.device.changed:  # past the bus, which may stall
            now_s = self.device.clock.now_s()
            answer = self.device._firmware.control_in(Request.GET_STATUS, 0, 0, now_s=now_s)
        return unpack_status(answer)

    def lit(self) -> bool:
        return self.status().light_on


class Kinect2:
    """A Kinect v2."""

    def __init__(self, root: Path) -> None:
        camera = kinects.emulated(clock=Slow())
        self.mount = Usb3Mount(camera, kinects.SERIAL, root)
        self.device = self.mount.device
        self.lit: Callable[[], bool] = lambda: camera.lit

    def stall(self, requests: int) -> None:
        self.mount.requests_to_stall = requests


class Opt8241:
    """An OPT8241-CDK."""

    def __init__(self, root: Path) -> None:
        self.device = OnBus(opt8241s.emulated())
        self.mount = Usb2Mount(self.device, root)
        self.lit: Callable[[], bool] = lambda: self.device.lit

    def stall(self, requests: int) -> None:
        with self.device.changed:
            self.device.requests_to_stall = requests


class Watch:
    """Sees the light go off, at most a moment later."""

    def __init__(self, lit: Callable[[], bool]) -> None:
        self._lit = lit
        self.off_s = time.monotonic()
        """When it was seen to have gone off, or while it is on, now."""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self._thread.start()

    def _look(self) -> None:
        before = False
        while not self._ending.wait(LOOK_EVERY_S):
            lit = self._lit()
            if lit or before:
                self.off_s = time.monotonic()
            before = lit

    def off_since(self, dark_s: float) -> float:
        """Wait until it is off for so long from now on; return since when, infinity for never."""
        begin_s = time.monotonic()
        while (left_s := max(self.off_s, begin_s) + dark_s - time.monotonic()) > 0.0:
            if time.monotonic() > begin_s + PATIENCE_S:
                return math.inf
            time.sleep(left_s + 2 * LOOK_EVERY_S)
        return self.off_s

    def close(self) -> None:
        self._ending.set()
        self._thread.join()


LIT_WITHIN_S = 5.0
PATIENCE_S = 60.0
LOOK_EVERY_S = 0.005
KINDS = {"usb": Prototype, "kinect2": Kinect2, "opt8241": Opt8241}


def main() -> None:
    root, kind = Path(sys.argv[1]), sys.argv[2]
    camera: Any = KINDS[kind](root)
    device, mount = camera.device, camera.mount
    watch = Watch(camera.lit)

    def obey(command: str, *arguments: Any) -> object:
        match command:
            case "unplug":
                mount.unplug()
            case "replug":
                mount.replug()
            case "halt":
                device.halt()
            case "inject":
                device.inject(Fault(arguments[0]), arguments[1])
            case "stall":
                camera.stall(arguments[0])
            case "interlock":
                device.set_interlock(closed=arguments[0])
            case "memory":
                mount.memory_bytes = arguments[0]
            case "signal":
                with device.changed:  # no request is obeyed between the two
                    lit = device.changed.wait_for(camera.lit, LIT_WITHIN_S)
                    sent_s = time.monotonic() if lit else None
                    if lit:
                        os.kill(arguments[0], arguments[1])
                return sent_s
            case "off":
                return watch.off_since(arguments[0])
            case "light":
                return camera.lit()
            case "watchdog":
                return camera.status().watchdog_tripped
            case _:
                return "unknown"
        return "done"

    print(json.dumps("ready"), flush=True)  # noqa: T201 - the protocol of this process
    for line in sys.stdin:
        print(json.dumps(obey(*json.loads(line))), flush=True)  # noqa: T201 - the same
    watch.close()
    mount.close()


if __name__ == "__main__":
    main()
