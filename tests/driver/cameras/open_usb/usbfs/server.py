"""The emulated camera as a process: ``python server.py ROOT``; commands come on standard input.

A command is a JSON list: what to do, and its arguments.
"""

import json
import sys
from pathlib import Path
from typing import Any

from usbfs import UsbfsMount  # type: ignore[import-not-found]  # beside this script, no package

from transientcam_driver.camera import Status
from transientcam_driver.cameras.open_usb.protocol import Request, unpack_status
from transientcam_driver.clock import RealClock
from transientcam_simulation.emulated import build, find_scene, without_noise
from transientcam_simulation.emulated._open_usb.faults import Fault


def main() -> None:
    scene = without_noise(find_scene("wall"))
    device, _ = build(scene, width=163, height=120, seed=1, clock=RealClock())
    mount = UsbfsMount(device, Path(sys.argv[1]))

    def status() -> Status:
        with device.changed:  # past the bus, which may stall
            now_s = device.clock.now_s()
            answer = device._firmware.control_in(Request.GET_STATUS, 0, 0, now_s=now_s)
        return unpack_status(answer)

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
                device.stall_next(arguments[0])
            case "interlock":
                device.set_interlock(closed=arguments[0])
            case "memory":
                mount.memory_bytes = arguments[0]
            case "light":
                return status().light_on
            case "watchdog":
                return status().watchdog_tripped
            case _:
                return "unknown"
        return "done"

    print(json.dumps("ready"), flush=True)  # noqa: T201 - the protocol of this process
    for line in sys.stdin:
        print(json.dumps(obey(*json.loads(line))), flush=True)  # noqa: T201 - the same
    mount.close()


if __name__ == "__main__":
    main()
