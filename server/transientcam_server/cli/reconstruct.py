"""The verb ``reconstruct`` of the ``transientcam`` command."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from transientcam.cli.options import JsonOption, TokenOption, require_suffix
from transientcam.cli.terminal import Terminal, echo, progress_bars
from transientcam_server.cli.cluster import DaskOption, WorkersOption
from transientcam_server.cli.options import DeviceOption
from transientcam_server.cli.reconstruct_recordings import (
    ReconstructionChoices,
    reconstruct_on_cluster,
    reconstruct_recording,
    settings_of,
)

if TYPE_CHECKING:
    from transientcam_server.offline import Measurement, TransientCube

Background = Literal["none", "median"]
Neighbours = Literal["edge-preserving", "gaussian", "none"]
_OF_MEASUREMENTS = {"smoothing_px": 0.0, "bias": 4e-3, "return_threshold": 0.1}
_HDF5 = b"\x89HDF\r\n\x1a\n"


def reconstruct(
    input: Annotated[  # noqa: A002 - it is what the argument is called in the help
        str,
        typer.Argument(
            help="An .npz with moments and base_frequency_hz, counts and bin_s, h with "
            "start_opl_m and bin_opl_m, or transient (mitransient) with start_opl and "
            "bin_width_opl; an HDF5 file of tal; or a recording: a file, the address of a daemon's "
            "(http://HOST:8000/api/v1/recordings/ID), or with a cluster a directory of them."
        ),
    ],
    output: Annotated[
        str,
        typer.Option(
            "--output",
            "-o",
            help="The .npz to write; of a recording .h5, .npz, .nc or .zarr. With a cluster a "
            ".zarr, also at an address such as s3://bucket/corner.zarr.",
        ),
    ],
    frequency_hz: Annotated[
        float | None, typer.Option(help="Base frequency for impulse responses.  [default: 23e6]")
    ] = None,
    harmonics: Annotated[
        int | None,
        typer.Option(help="How many multiples of it; at most those of the moments.  [default: 4]"),
    ] = None,
    bins: Annotated[int, typer.Option(min=1, max=65536, help="Times of flight.")] = 256,
    bias: Annotated[
        float | None,
        typer.Option(
            help="Least uniform part of a pixel, over its brightness (Sec. 4.3).  "
            "[default: 4e-3; of a recording, as recorded]"
        ),
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="What finds the range, by the names of docs/estimators.md.  "
            "[default: automatic; of a recording, as recorded]"
        ),
    ] = None,
    neighbours: Annotated[
        Neighbours | None,
        typer.Option(
            help="How pixels are averaged.  [default: --smoothing-px; of a recording, as recorded]"
        ),
    ] = None,
    smoothing_px: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=10.0,
            help="Standard deviation of a Gaussian smoothing.  "
            "[default: 0; of a recording, as recorded]",
        ),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            help="Weight of the first return, over the strongest.  "
            "[default: 0.1; of a recording, as recorded]",
        ),
    ] = None,
    background: Annotated[
        Background, typer.Option(help="What to subtract from photon counts first.")
    ] = "none",
    product: Annotated[
        list[str] | None,
        typer.Option(help="Of a recording: what to compute; may be repeated.  [default: images]"),
    ] = None,
    device: DeviceOption = "cpu",
    plot: Annotated[Path | None, typer.Option(help="Also draw a picture into this .png.")] = None,
    workers: WorkersOption = None,
    dask: DaskOption = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Reconstruct a measurement in a file: density, cumulative density, range, direct, indirect.

    Of a recording every frame is reconstructed; a second run goes on where the first stopped.
    `--workers` and `--dask` compute its frames on a cluster, each worker a part of them.
    """
    import transientcam_moments as tm
    from transientcam_server import offline
    from transientcam_server.offline import plot as pictures

    tm.kernels.use_device(device)
    if plot is not None:
        require_suffix(plot, ".png", hint="--plot")
        pictures.require("--plot")
    options: dict[str, float | str | None] = {"smoothing_px": smoothing_px, "bias": bias}
    options |= {"return_threshold": threshold, "estimator": estimator}
    options["neighbours"] = neighbours or (None if smoothing_px is None else "gaussian")
    given = {name: value for name, value in options.items() if value is not None}
    clustered = workers is not None or dask is not None
    if clustered or "://" in input or _is_recording(Path(input)):
        wanted = ReconstructionChoices(tuple(product or ()), given, bins)
        if clustered:
            if device != "cpu":
                raise typer.BadParameter("on a cluster it is cpu", param_hint="--device")
            reconstruct_on_cluster(input, output, wanted, workers, dask, token, as_json=as_json)
        else:
            reconstruct_recording(input, Path(output), wanted, token, as_json=as_json)
        return
    if neighbours == "edge-preserving":
        raise typer.BadParameter("needs the noise of a sensor", param_hint="--neighbours")
    require_suffix(Path(output), ".npz")
    settings = settings_of(_OF_MEASUREMENTS | given)
    measurement = offline.load_measurement(
        Path(input), frequency_hz=frequency_hz, harmonics=harmonics, background=background
    )
    console = Terminal(stderr=True)
    with progress_bars(console=console) as progress:
        task = progress.add_task("reconstructing", total=None)

        def advance(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        cube = offline.reconstruct_measurement(
            measurement, bins=bins, settings=settings, progress=advance
        )
        progress.update(task, description="writing")
        offline.save_cube(Path(output), cube)
        if plot is not None:
            progress.update(task, description="drawing")
            pictures.save_picture(plot, cube)
    if as_json:
        echo(json.dumps(_document(measurement, cube, output)))
    else:
        _print_cube(console, _document(measurement, cube, output))


def _document(measurement: "Measurement", cube: "TransientCube", output: str) -> dict[str, Any]:
    import numpy as np

    import transientcam_moments as tm

    height, width = cube.flags.shape
    counts = {
        str(flag.name).lower(): int(np.count_nonzero(cube.flags & flag.value))
        for flag in filter(None, tm.Flags)
    }
    return {
        "file": output,
        "width": width,
        "height": height,
        "harmonics": measurement.harmonics,
        "base_frequency_hz": measurement.base_frequency_hz,
        "times": cube.time_s.size,
        "flagged": counts,
    }


def _print_cube(console: Terminal, document: dict[str, Any]) -> None:
    console.print(
        "{file}: {width} x {height} pixels, m = {harmonics} at ".format(**document)
        + f"{document['base_frequency_hz'] / 1e6:g} MHz, {document['times']} times of flight"
    )
    for flag, count in document["flagged"].items():
        if count:
            console.print(f"  {count} pixels flagged {flag.replace('_', ' ')}")


def _is_recording(path: Path) -> bool:
    """Whether a file is HDF5, and not an impulse response of tal."""
    from transientcam_server.offline import is_tal

    with path.open("rb") as file:
        is_hdf5 = file.read(len(_HDF5)) == _HDF5
    return is_hdf5 and not is_tal(path)
