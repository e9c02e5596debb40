"""``transientcam foxglove``: a camera's frames, live, in Foxglove."""

import json
from typing import Annotated

import typer
from rich.console import Console

from transientcam.camera import Camera
from transientcam.cli.options import JsonOption, TokenOption, UrlArgument
from transientcam.cli.showing import shown_on
from transientcam.robotics import SHOWN, FoxgloveBridge


def foxglove(
    url: UrlArgument,
    products: Annotated[
        list[str] | None,
        typer.Argument(
            help="What can be looked at; range, direct, indirect, brightness and pointcloud, if "
            "nothing is named."
        ),
    ] = None,
    host: Annotated[
        str,
        typer.Option(help="Where to serve viewers; every machine that reaches it sees the frames."),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 for any that is free.")] = 8765,
    max_rate_hz: Annotated[
        float, typer.Option(min=0.01, help="Maximum frames per second shown.")
    ] = 10.0,
    control: Annotated[
        bool,
        typer.Option(
            "--control",
            help="Let viewers set parameters, and start a stopped camera for one capture; every "
            "machine that reaches the port can.",
        ),
    ] = False,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a camera live in Foxglove, until interrupted: images, points, lens and pose.

    Without --control it only subscribes, and only to what is looked at.
    """
    console = Console(stderr=True)
    with (
        Camera(url, token=token) as camera,
        FoxgloveBridge(
            camera,
            products=products or SHOWN,
            host=host,
            port=port,
            max_rate_hz=max_rate_hz,
            control=control,
            on_report=shown_on(console, as_json=as_json),
        ) as bridge,
    ):
        address = f"ws://{host}:{bridge.port}"
        if as_json:
            typer.echo(json.dumps({"type": "serving", "url": address}))
        else:
            console.print(f"open {address} in Foxglove (Open connection, Foxglove WebSocket)")
        bridge.run()
