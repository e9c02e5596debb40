"""The verbs ``replay``, ``recover`` and ``convert`` of the ``transientcam`` command.

What is heavy is imported when a verb runs, so that ``transientcam --help`` stays quick.
"""

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

if TYPE_CHECKING:
    from transientcam_server.settings import ReconstructionSettings

_HDF5 = b"\x89HDF\r\n\x1a\n"
RecordingArgument = Annotated[Path, typer.Argument(metavar="RECORDING", help="A recording's file.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]


def replay(
    recording: RecordingArgument,
    speed: Annotated[
        str, typer.Option(help="original, fast (as fast as it can be read) or a factor.")
    ] = "original",
    loop: Annotated[bool, typer.Option("--loop", help="Begin anew after the last frame.")] = False,
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
    from transientcam_server.cli.serve import serve

    looped = "on" if loop else "off"
    spec = f"recording:{recording}?speed={speed}&loop={looped}"
    serve(camera=spec, host=host, port=port, config=config, as_json=as_json)


def recover(
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="An unfinished recording (.part), or a directory."),
    ],
    as_json: JsonOption = False,
) -> None:
    """Make recordings of what a service left that was killed; it does so itself when it starts."""
    from transientcam_server.recording import recovery

    directory = path if path.is_dir() else path.parent
    with _nobody_writing(directory), Console(stderr=True).status("recovering"):
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
def _nobody_writing(directory: Path) -> Iterator[None]:
    """Refuse while a service uses the directory: what is unfinished there may be alive."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OSError(
                16, "a service records there; it recovers by itself when it starts", str(directory)
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
    from transientcam_server.offline import convert as converting
    from transientcam_server.recording import Recording

    with Recording(recording) as opened, _progress("converting") as advance:
        converting.convert(opened, output, progress=advance)
        frames = opened.frames
    if as_json:
        typer.echo(json.dumps({"file": str(output), "frames": frames}))
    else:
        Console(stderr=True).print(f"{output}: {frames} frames", soft_wrap=True)


def is_recording(path: Path) -> bool:
    """Whether a file is HDF5, which of all inputs only recordings are."""
    with path.open("rb") as file:
        return file.read(len(_HDF5)) == _HDF5


def reconstruct_recording(
    recording: Path,
    output: Path,
    *,
    products: list[str] | None,
    settings: "ReconstructionSettings",
    bins: int,
    as_json: bool = False,
) -> None:
    """Reconstruct every frame of a recording, going on where an earlier run stopped."""
    from transientcam_server.offline import recording as offline
    from transientcam_server.recording import Recording

    wanted = tuple(dict.fromkeys(products or offline.DEFAULT_PRODUCTS))
    for name in wanted:
        if name not in offline.KNOWN_PRODUCTS:
            known = ", ".join(offline.KNOWN_PRODUCTS)
            raise typer.BadParameter(f"{name!r} is none of {known}", param_hint="--product")
    what = offline.Wanted(wanted, settings, bins)
    with Recording(recording) as opened, _progress("reconstructing") as advance:
        before = offline.reconstruct(opened, output, what, progress=advance)
        frames = opened.frames
    if as_json:
        document = {"file": str(output), "products": wanted, "frames": frames, "before": before}
        typer.echo(json.dumps(document))
        return
    resumed = f", {before} of them before" if before else ""
    Console(stderr=True).print(
        f"{output}: {', '.join(wanted)} of {frames} frames{resumed}", soft_wrap=True
    )


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
    ) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
