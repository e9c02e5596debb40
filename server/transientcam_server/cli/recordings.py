"""The verbs ``recover`` and ``convert`` of the ``transientcam`` command.

What is heavy is imported when a verb runs, so that ``transientcam --help`` stays quick.
"""

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from transientcam.cli.options import JsonOption
from transientcam_server.cli.options import RecordingArgument
from transientcam_server.cli.progress import progress_bar


def recover(
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="An unfinished recording (.part), or a directory."),
    ],
    as_json: JsonOption = False,
) -> None:
    """Recover the unfinished recordings of a killed service; its next start does the same."""
    from transientcam_server.recording import recovery

    directory = path if path.is_dir() else path.parent
    with _exclusive(directory), Console(stderr=True).status("recovering"):
        if path.is_dir():
            parts = recovery.unfinished(path)
            recovered = recovery.recover_all(path)
        else:
            parts, recovered = [path], [recovery.recover(path)]
    if as_json:
        left = [str(part) for part in parts if part.exists()]
        typer.echo(json.dumps({"recovered": [str(each) for each in recovered], "left": left}))
    else:
        for each in recovered:
            typer.echo(f"recovered {each}")
        typer.echo(f"{len(recovered)} of {len(parts)} recovered")
    if len(recovered) < len(parts):
        raise typer.Exit(code=1)


@contextmanager
def _exclusive(directory: Path) -> Iterator[None]:
    """Refuse while a service uses the directory: it may still write the unfinished files."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OSError(
                16, "a service records there; it recovers them when it starts", str(directory)
            ) from None
        yield
    finally:
        os.close(descriptor)


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
