"""The verb ``convert`` of the ``transientcam`` command."""

import json
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo, progress_bar
from transientcam_server.cli.options import RecordingArgument

_CLOCK_SET_S: Final = 1.0


def convert(
    recording: RecordingArgument,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="The .npz, .nc, .zarr, .mcap or .json to write.")
    ],
    product: Annotated[
        list[str] | None,
        typer.Option(
            help="Products in an .mcap, such as range,pointcloud,raw; "
            "separated by commas, or repeated.  [default: raw]"
        ),
    ] = None,
    schemas: Annotated[
        Literal["foxglove", "ros2"],
        typer.Option(help="Of an .mcap: whose messages it holds; a file holds those of one."),
    ] = "foxglove",
    url: Annotated[
        str | None,
        typer.Option(
            help="Of a .json: where readers find the recording, such as s3://bucket/corner.h5.  "
            "[default: the file itself]"
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Convert a recording: .npz (NumPy), .nc (netCDF), .zarr (Dask), .mcap (Foxglove or ROS 2).

    A .json holds no images but where they are in the file: by it Zarr readers read the recording
    from a disk or an object store (kerchunk).
    """
    from transientcam_server.offline import convert_recording, lens_of
    from transientcam_server.recording import Recording

    products = [name.strip() for text in product or ["raw"] for name in text.split(",")]
    with Recording(recording) as opened, progress_bar("converting") as advance:
        convert_recording(
            opened, output, products=products, schemas=schemas, url=url, progress=advance
        )
        frames, lens = opened.frames, lens_of(opened)
        arrived_s = opened.series("host_time_s") - opened.captured_unix_s
    if as_json:
        echo(json.dumps({"file": str(output), "frames": frames}))
        return
    console = Terminal(stderr=True)
    console.print(f"{output}: {frames} frames")
    if frames and (step_s := float(np.ptp(arrived_s))) > _CLOCK_SET_S:
        console.print(
            f"the host's clock was set while it recorded, by up to {step_s:.0f} s: times of "
            "captures are those of the camera's clock"
        )
    if "pointcloud" in products and lens.source == "assumed":
        console.print(
            f"the recording does not say its lens: points, depth and calibration assume "
            f"fx = {lens.fx:.1f} pixels"
        )
