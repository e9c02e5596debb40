"""The emulated camera as a process: ``python server.py ROOT``; commands come on standard input."""

import json
import sys
from pathlib import Path

from transientcam_driver.protocol import Request, Status
from transientcam_driver.simulation.build import build, find_scene
from transientcam_driver.simulation.clock import RealClock
from usbfs import UsbfsMount  # type: ignore[import-not-found]  # beside this script, no package


def main() -> None:
    device, _ = build(find_scene("mirrors"), width=163, height=120, seed=1, clock=RealClock())
    mount = UsbfsMount(device, Path(sys.argv[1]))
    answer: object = "ready"
    print(json.dumps(answer), flush=True)  # noqa: T201 - the protocol of this process
    for line in sys.stdin:
        answer = "done"
        match line.strip():
            case "unplug":
                mount.unplug()
            case "replug":
                mount.replug()
            case "halt":
                device.halt()
            case "light":
                status = device.control(0xC0, Request.GET_STATUS, 0, 0, Status.BYTES, b"")
                answer = Status.unpack(status).light_on
            case _:
                answer = "unknown"
        print(json.dumps(answer), flush=True)  # noqa: T201 - the same
    mount.close()


if __name__ == "__main__":
    main()
