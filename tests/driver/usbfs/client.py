"""A program that uses ``open_camera("usb")``, driven line by line by a test."""

import json
import sys
from typing import Any

from transientcam_driver import Camera, DriverError, Sequence, open_camera

VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3)


class Session:
    """One camera, and what may be asked of it."""

    camera: Camera

    def open(self) -> dict[str, Any]:
        self.camera = open_camera("usb")
        return {"serial": self.camera.capabilities.serial, "state": self.camera.state}

    def open_another(self) -> None:
        open_camera("usb").close()

    def open_wrong(self) -> None:
        open_camera("usb:NOT-THIS-ONE")

    def start(self) -> dict[str, Any]:
        applied = self.camera.configure(VIDEO)
        self.camera.start()
        return {"images": applied.images, "epoch": applied.epoch}

    def read(self) -> dict[str, Any]:
        frame = self.camera.read_frame(timeout_s=20)
        return {
            "number": frame.number,
            "shape": frame.images.shape,
            "mean": float(frame.images.mean()),
            "lost": frame.lost_images,
            "state": self.camera.state,
            "resyncs": self.camera.counters.resyncs,
        }

    def status(self) -> bool:
        return self.camera.status().light_on

    def reconnect(self) -> str:
        self.camera.reconnect()
        return self.camera.state

    def close(self) -> str:
        self.camera.close()
        return self.camera.state


def main() -> None:
    session = Session()
    for line in sys.stdin:
        try:
            answer = {"value": getattr(session, line.strip())()}
        except DriverError as error:
            answer = {"error": type(error).__name__, "text": str(error)}
        print(json.dumps(answer), flush=True)  # noqa: T201 - the protocol of this process


if __name__ == "__main__":
    main()
