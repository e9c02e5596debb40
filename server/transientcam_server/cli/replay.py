"""The verb ``replay`` of the ``transientcam`` command."""

from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam_server.cli.options import ConfigOption, HostOption, PortOption, RecordingArgument
from transientcam_server.cli.serve import serve


def replay(
    recording: RecordingArgument,
    speed: Annotated[
        str, typer.Option(help="original, fast (as fast as it can be read) or a factor.")
    ] = "original",
    loop: Annotated[bool, typer.Option("--loop", help="Start again after the last frame.")] = False,
    host: HostOption = None,
    port: PortOption = None,
    config: ConfigOption = None,
    as_json: JsonOption = False,
) -> None:
    """Serve a recording as if it were the camera: every frame again, bit for bit."""
    looped = "on" if loop else "off"
    spec = f"recording:{recording}?speed={speed}&loop={looped}"
    serve(camera=spec, host=host, port=port, config=config, as_json=as_json)
