"""The verb ``emulate``: an emulated camera on the network, for other programs than this one."""

import json
import threading
from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import echo
from transientcam_driver.camera import CameraName
from transientcam_driver.cameras.tofcam660 import CONTROL_PORT, DATA_PORT
from transientcam_driver.clock import RealClock
from transientcam_simulation.emulated import build_tofcam660
from transientcam_simulation.entries.sim import scene_of


def emulate(
    scene: Annotated[
        str, typer.Argument(help="A scene's name or .toml, with options as in 'wall?noise=off'.")
    ] = "hall",
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    control_port: Annotated[
        int, typer.Option(min=0, max=65535, help="For commands; 0 takes any free one.")
    ] = CONTROL_PORT,
    data_port: Annotated[
        int, typer.Option(min=0, max=65535, help="For images over TCP; 0 takes any free one.")
    ] = DATA_PORT,
    udp_port: Annotated[
        int, typer.Option(min=1, max=65535, help="Where hosts wait for images over UDP.")
    ] = DATA_PORT,
    as_json: JsonOption = False,
) -> None:
    """Run an emulated ESPROS TOFcam660 in front of a scene, until it is interrupted."""
    wanted = scene_of(CameraName.parse(f"sim:{scene}"))
    device, _ = build_tofcam660(
        wanted.load(),
        seed=wanted.seed,
        clock=RealClock(),
        host=host,
        control_port=control_port,
        data_port=data_port,
        udp_port=udp_port,
    )
    where = {"host": host, "control_port": device.control_port, "data_port": device.data_port}
    if as_json:
        print(json.dumps(where), flush=True)  # noqa: T201 - the caller reads it from a pipe
    else:
        ports = f"commands on port {device.control_port}, images on {device.data_port}"
        echo(f"an emulated TOFcam660 at {host}: {ports} (Ctrl-C ends it)")
    try:
        threading.Event().wait()
    finally:
        device.close()
