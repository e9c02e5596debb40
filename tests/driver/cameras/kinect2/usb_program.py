"""A program that uses a Kinect v2 by the real libusb: ``python usb_program.py``.

Each line on standard input is a step; the answer to it is one line of JSON.
"""

import hashlib
import json
import sys
from typing import Any

from transientcam_driver.cameras.kinect2 import Kinect2Camera, SameKinect, list_kinects
from transientcam_driver.errors import DriverError


def main() -> None:
    camera: Any = None
    for line in sys.stdin:
        step = line.strip()
        try:
            if step == "list":
                answer: Any = [(each.spec, each.problem) for each in list_kinects()]
            elif step == "open":
                camera = Kinect2Camera(SameKinect(None, pause=lambda s: None))
                answer = [camera.capabilities.serial, camera.capabilities.firmware]
            elif step == "read":
                frame = camera.read_frame(timeout_s=600.0)
                answer = hashlib.sha256(frame.images.tobytes()).hexdigest()
            else:
                getattr(camera, step)()
                answer = str(camera.state)
        except DriverError as error:
            answer = {type(error).__name__: str(error)}
        print(json.dumps(answer), flush=True)  # noqa: T201 - the protocol of this process


if __name__ == "__main__":
    main()
