"""``transientcam foxglove``: a camera's frames, live, in Foxglove."""

import json
from typing import Annotated

import typer

from transientcam.camera import Camera
from transientcam.cli.options import JsonOption, TokenOption, UrlArgument
from transientcam.cli.showing import shown_on
from transientcam.cli.terminal import Terminal, echo
from transientcam.robotics import SHOWN, FoxgloveBridge


def foxglove(
    url: UrlArgument,
    products: Annotated[
        list[str] | None,
        typer.Argument(
            help="What can be looked at, maps of other packages, too; range, direct, indirect, "
            "brightness and pointcloud, if nothing is named."
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(help="Where to serve viewers; whoever knows the address sees the frames.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="0 for any that is free.")] = 8765,
    max_rate_hz: Annotated[
        float, typer.Option(min=0.01, help="Maximum frames per second shown.")
    ] = 10.0,
    control: Annotated[
        bool, typer.Option("--control", help="Let viewers set parameters, and stop the camera.")
    ] = False,
    control_light: Annotated[
        bool,
        typer.Option(
            "--control-light",
            help="Let viewers also start the camera, which switches its light on.",
        ),
    ] = False,
    origin: Annotated[
        list[str] | None,
        typer.Option(
            help="A page that may connect, such as https://app.foxglove.dev; programs need none."
        ),
    ] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a camera live in Foxglove, until interrupted: images, points, lens and pose.

    Without --control it only subscribes, and only to what is looked at. The address that it prints
    has a secret where it uses a token, has control, or is reached by other machines.
    """
    console = Terminal(stderr=True)
    with (
        Camera(url, token=token) as camera,
        FoxgloveBridge(
            camera,
            products=products or SHOWN,
            host=host,
            port=port,
            max_rate_hz=max_rate_hz,
            control=control,
            control_light=control_light,
            origins=origin or (),
            on_report=shown_on(console, as_json=as_json),
        ) as bridge,
    ):
        if as_json:
            echo(json.dumps({"type": "serving", "url": bridge.url}))
        else:
            console.print(f"open {bridge.url} in Foxglove (Open connection, Foxglove WebSocket)")
        bridge.run()
