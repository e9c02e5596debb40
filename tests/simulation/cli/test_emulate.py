"""`transientcam emulate`: an emulated camera in a process of its own."""

import json
import subprocess
import sys

from transientcam_driver import TriggeredCamera
from transientcam_driver.cameras.tofcam660 import DeviceOptions, Region, Tofcam660

PROGRAM = """
import typer
from transientcam_simulation.cli.emulate import emulate
app = typer.Typer()
app.command()(emulate)
app()
"""


def test_another_process_is_a_camera_until_it_is_terminated() -> None:
    command = [sys.executable, "-c", PROGRAM, "wall?noise=off", "--json"]
    ports = ["--control-port", "0", "--data-port", "0"]
    with subprocess.Popen([*command, *ports], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            where = json.loads(process.stdout.readline())
            options = DeviceOptions(
                region=Region(152, 112, 168, 128),
                settle_s=0.0,
                control_port=where["control_port"],
                data_port=where["data_port"],
            )
            with TriggeredCamera(lambda: Tofcam660(where["host"], options)) as camera:
                camera.start()
                frame = camera.read_frame(timeout_s=60.0)
        finally:  # whatever fails above, or the end of the block would wait for it
            process.terminate()

    assert frame.images.shape[1:] == (16, 16)
    assert 2048 < frame.images.max() < 4095
