"""The verb ``replay`` of the ``transientcam`` command."""

from pathlib import Path
from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam_server.cli.options import RecordingArgument
from transientcam_server.cli.serve import serve


def replay(
    recording: RecordingArgument,
    speed: Annotated[
        str, typer.Option(help="original, fast (as fast as it can be read) or a factor.")
    ] = "original",
    loop: Annotated[bool, typer.Option("--loop", help="Start again after the last frame.")] = False,
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.  [default: 127.0.0.1]")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="TCP port; 0 takes any free one.  [default: 8000]")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Settings in TOML.  [default: ./transientcam.toml]")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Serve a recording as if it were the camera: every frame again, bit for bit."""
    looped = "on" if loop else "off"
    spec = f"recording:{recording}?speed={speed}&loop={looped}"
    serve(camera=spec, host=host, port=port, config=config, as_json=as_json)
