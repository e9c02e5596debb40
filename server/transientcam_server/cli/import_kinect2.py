"""The verb ``import-kinect2`` of the ``transientcam`` command."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from transientcam.cli.options import JsonOption, require_suffix
from transientcam.cli.terminal import Terminal, echo, progress_bar


def import_kinect2(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.h5",
            help="Raw frames of a Kinect v2, with /P0Tables and /Frame_n/Ir, as "
            "felja633/kinectv2_decoders reads them.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="The recording (.h5) to write.")],
    lens: Annotated[
        Path | None,
        typer.Option(
            help="An .h5 with leader_calibration_parameters: the lens.  [default: unknown]"
        ),
    ] = None,
    rows: Annotated[
        Literal["top", "bottom"],
        typer.Option(help="Which side the lens' cy is counted from (docs/kinect2.md)."),
    ] = "top",
    as_json: JsonOption = False,
) -> None:
    """Import raw frames of a Kinect v2 as a recording, to replay, reconstruct and convert."""
    from transientcam_server.offline import import_kinect2 as imported, read_lens

    require_suffix(output, ".h5")
    known = None if lens is None else read_lens(lens, rows)
    with progress_bar("importing") as advance:
        frames = imported(file, output, lens=known, progress=advance)
    if as_json:
        echo(json.dumps({"file": str(output), "frames": frames}))
    else:
        Terminal(stderr=True).print(f"{output}: {frames} frames")
