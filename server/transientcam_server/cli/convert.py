"""The verb ``convert`` of the ``transientcam`` command.

What is heavy is imported when the verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from transientcam.cli.options import JsonOption
from transientcam_server.cli.options import RecordingArgument
from transientcam_server.cli.progress import progress_bar


def convert(
    recording: RecordingArgument,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The .npz, .nc, .zarr or .mcap to write.")
    ],
    as_json: JsonOption = False,
) -> None:
    """Convert a recording: .npz (NumPy), .nc (netCDF), .zarr (Dask), .mcap (Foxglove, ROS)."""
    from transientcam_server.offline import convert_recording
    from transientcam_server.recording import Recording

    with Recording(recording) as opened, progress_bar("converting") as advance:
        convert_recording(opened, output, progress=advance)
        frames = opened.frames
    if as_json:
        typer.echo(json.dumps({"file": str(output), "frames": frames}))
    else:
        Console(stderr=True).print(f"{output}: {frames} frames", soft_wrap=True)
