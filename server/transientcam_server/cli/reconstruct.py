"""The verb ``reconstruct`` of the ``transientcam`` command.

What is heavy is imported when the verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console

from transientcam.cli.options import JsonOption, require_suffix
from transientcam_server.cli.progress import progress_bar, progress_bars

if TYPE_CHECKING:
    from transientcam_server.offline import Measurement, TransientCube
    from transientcam_server.settings import ReconstructionSettings

Background = Literal["none", "median"]
_OF_MEASUREMENTS = {"smoothing_px": 0.0, "bias": 4e-3, "return_threshold": 0.1}
_HDF5 = b"\x89HDF\r\n\x1a\n"


def reconstruct(
    input: Annotated[  # noqa: A002 - it is what the argument is called in the help
        Path,
        typer.Argument(
            help="An .npz with moments and base_frequency_hz, counts and bin_s, h with "
            "start_opl_m and bin_opl_m, or transient (mitransient) with start_opl and "
            "bin_width_opl; an HDF5 file of tal; or a recording."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="The .npz to write; of a recording .h5, .npz, .nc or .zarr."
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
    plot: Annotated[Path | None, typer.Option(help="Also draw a picture into this .png.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Reconstruct a measurement in a file: density, cumulative density, range, direct, indirect.

    Of a recording every frame is reconstructed; a second run goes on where the first stopped.
    """
    from transientcam_server import offline
    from transientcam_server.offline import plot as pictures

    if plot is not None:
        require_suffix(plot, ".png", hint="--plot")
        pictures.require()
    options = {"smoothing_px": smoothing_px, "bias": bias, "return_threshold": threshold}
    given = {name: value for name, value in options.items() if value is not None}
    if _is_recording(input):
        _reconstruct_recording(
            input, output, products=product, changes=given, bins=bins, as_json=as_json
        )
        return
    require_suffix(output, ".npz")
    settings = _settings(_OF_MEASUREMENTS | given)
    measurement = offline.load_measurement(
        input, frequency_hz=frequency_hz, harmonics=harmonics, background=background
    )
    console = Console(stderr=True)
    with progress_bars(console=console) as progress:
        task = progress.add_task("reconstructing", total=None)

        def advance(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        cube = offline.reconstruct_measurement(
            measurement, bins=bins, settings=settings, progress=advance
        )
        progress.update(task, description="writing")
        offline.save_cube(output, cube)
        if plot is not None:
            progress.update(task, description="drawing")
            pictures.save_picture(plot, cube)
    if as_json:
        typer.echo(json.dumps(_document(measurement, cube, output)))
    else:
        _print_cube(console, _document(measurement, cube, output))


def _document(measurement: "Measurement", cube: "TransientCube", output: Path) -> dict[str, Any]:
    import numpy as np

    import transientcam_moments as tm

    height, width = cube.flags.shape
    counts = {
        str(flag.name).lower(): int(np.count_nonzero(cube.flags & flag.value))
        for flag in filter(None, tm.Flags)
    }
    return {
        "file": str(output),
        "width": width,
        "height": height,
        "harmonics": measurement.harmonics,
        "base_frequency_hz": measurement.base_frequency_hz,
        "times": cube.time_s.size,
        "flagged": counts,
    }


def _print_cube(console: Console, document: dict[str, Any]) -> None:
    console.print(
        "{file}: {width} x {height} pixels, m = {harmonics} at ".format(**document)
        + f"{document['base_frequency_hz'] / 1e6:g} MHz, {document['times']} times of flight",
        soft_wrap=True,
    )
    for flag, count in document["flagged"].items():
        if count:
            console.print(f"  {count} pixels flagged {flag.replace('_', ' ')}")


def _settings(values: Mapping[str, Any]) -> "ReconstructionSettings":
    """Return settings with these values, or refuse the one that cannot be used."""
    from pydantic import ValidationError

    from transientcam_server.settings import ReconstructionSettings

    try:
        return ReconstructionSettings.model_validate(dict(values))
    except ValidationError as error:
        mistake = error.errors()[0]
        raise typer.BadParameter(f"{mistake['loc'][0]}: {mistake['msg']}") from error


def _is_recording(path: Path) -> bool:
    """Whether a file is HDF5, and not an impulse response of tal."""
    from transientcam_server.offline.impulse_responses import is_tal

    with path.open("rb") as file:
        is_hdf5 = file.read(len(_HDF5)) == _HDF5
    return is_hdf5 and not is_tal(path)


def _reconstruct_recording(
    recording: Path,
    output: Path,
    *,
    products: list[str] | None,
    changes: dict[str, float],
    bins: int,
    as_json: bool = False,
) -> None:
    """Reconstruct every frame of a recording, continuing an interrupted run."""
    from transientcam_server.offline import BatchOptions, reconstruct_recording
    from transientcam_server.offline.recording import KNOWN_PRODUCTS, default_products
    from transientcam_server.recording import Recording

    for name in products or ():
        if name not in KNOWN_PRODUCTS:
            known = ", ".join(KNOWN_PRODUCTS)
            raise typer.BadParameter(f"{name!r} is none of {known}", param_hint="--product")
    with Recording(recording) as opened, progress_bar("reconstructing") as advance:
        names = tuple(dict.fromkeys(products or default_products(opened.header.applied)))
        settings = _settings({**opened.header.reconstruction, **changes})
        options = BatchOptions(names, settings, bins)
        before = reconstruct_recording(opened, output, options, progress=advance)
        frames = opened.frames
    if as_json:
        document = {"file": str(output), "products": names, "frames": frames, "before": before}
        typer.echo(json.dumps(document))
        return
    resumed = f", {before} of them before" if before else ""
    Console(stderr=True).print(
        f"{output}: {', '.join(names)} of {frames} frames{resumed}", soft_wrap=True
    )
