"""The verbs ``serve``, ``reconstruct`` and ``compile`` of the ``transientcam`` command.

What is heavy is imported when a verb runs, so that ``transientcam --help`` stays quick.
"""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from transientcam_server.offline.measurement import Measurement, Reconstruction

Background = Literal["none", "median"]
_Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]


def serve(
    camera: Annotated[
        str | None,
        typer.Option(
            help="usb[:SERIAL], sim:SCENE or recording:FILE  [default: sim:mirrors]",
            autocompletion=lambda: _camera_names(),
        ),
    ] = None,
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.  [default: 127.0.0.1]")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="TCP port; 0 takes any free one.  [default: 8000]")
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(help="A file of `transientcam calibrate`.  [default: nominal gains]"),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Settings in TOML.  [default: ./transientcam.toml]")
    ] = None,
    announce: Annotated[
        bool | None,
        typer.Option(help="Tell the local network where it is.  [default: if others may come in]"),
    ] = None,
    insecure: Annotated[
        bool,
        typer.Option("--insecure", help="Let anybody who reaches the port control the camera."),
    ] = False,
    tls_certificate: Annotated[
        Path | None, typer.Option(help="Certificate chain in PEM: serve https and wss.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(help="Its private key in PEM, where it is in another file.")
    ] = None,
    log_level: Annotated[str | None, typer.Option(help="debug, info, warning or error.")] = None,
    check: Annotated[
        bool,
        typer.Option("--check", help="Only say which settings hold, and where each was given."),
    ] = False,
    as_json: _Json = False,
) -> None:
    """Run the daemon: a camera on the network, with its dashboard."""
    from transientcam_server.daemon.configuration import load_settings

    command_line = {
        "camera": camera,
        "calibration": calibration,
        "host": host,
        "port": port,
        "announce": None if announce is None else ("off", "on")[announce],
        "insecure": insecure or None,
        "tls_certificate": tls_certificate,
        "tls_key": tls_key,
        "log_level": log_level,
    }
    if check:
        _check(command_line, config, as_json=as_json)
        return
    settings = load_settings(command_line, file=config, environment=os.environ)

    import transientcam_moments as tm
    from transientcam_server.api.app import build_app
    from transientcam_server.camera.source import open_camera
    from transientcam_server.daemon import server
    from transientcam_server.daemon import server as long_lived

    server.configure_logging(settings)
    # the address first: where another daemon has it, the camera is not touched
    with server.ending_without() as leave, server.listen(settings.host, settings.port) as listener:
        url = server.address(listener, tls=settings.tls_certificate is not None)
        with open_camera(settings.camera) as opened:
            # NumPy serves until the compiled kernels are ready
            compiling = tm.kernels.compile_in_background()
            leave(compiling)
            app = build_app(opened, settings)
            long_lived.set_aside_after(compiling)
            server.serve(
                app,
                settings,
                listener,
                on_listening=lambda: _announce(url, settings.camera, as_json=as_json),
            )


def _camera_names() -> list[str]:
    from transientcam_driver import list_scenes

    return ["usb", *(f"sim:{scene.name}" for scene in list_scenes())]


def _check(command_line: dict[str, Any], config: Path | None, *, as_json: bool) -> None:
    from transientcam_server.daemon import check as checking
    from transientcam_server.daemon.configuration import load
    from transientcam_server.errors.exceptions import SettingsError

    try:
        configuration = load(command_line, file=config, environment=os.environ)
        checking.require_usable(configuration)
    except SettingsError as error:
        if not as_json:
            raise
        mistakes = checking.mistakes_document(error)
        typer.echo(json.dumps({"valid": False, "mistakes": mistakes}, default=str))
        raise typer.Exit(code=1) from error
    document = checking.to_document(configuration)
    if as_json:
        typer.echo(json.dumps({"valid": True, "settings": document}))
        return
    for line in checking.to_toml(document):
        typer.echo(line)


def _announce(url: str, camera: str, *, as_json: bool) -> None:
    if as_json:
        # whoever waits for the line reads it from a pipe
        print(json.dumps({"url": url, "camera": camera, "pid": os.getpid()}), flush=True)  # noqa: T201
        return
    console = Console()
    console.print(
        f"transientcam serves {camera} at [bold link={url}]{url}[/] (Ctrl-C ends it)",
        soft_wrap=True,
    )


def reconstruct(
    input: Annotated[  # noqa: A002 - it is what the argument is called in the help
        Path,
        typer.Argument(
            help="An .npz with moments and base_frequency_hz, counts and bin_s, or h with "
            "start_opl_m and bin_opl_m; or a recording."
        ),
    ],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="The .npz to write; of a recording, the .h5."),
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
        float, typer.Option(help="Least uniform part of a pixel, over its brightness (Sec. 4.3).")
    ] = 4e-3,
    smoothing_px: Annotated[
        float, typer.Option(min=0.0, max=10.0, help="Standard deviation of a Gaussian smoothing.")
    ] = 0.0,
    threshold: Annotated[
        float, typer.Option(min=0.0, help="Weight of the first return, over the strongest.")
    ] = 0.1,
    background: Annotated[
        Background, typer.Option(help="What to subtract from photon counts first.")
    ] = "none",
    product: Annotated[
        list[str] | None,
        typer.Option(help="Of a recording: what to compute; may be repeated.  [default: images]"),
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Also draw a picture into this .png.")] = None,
    as_json: _Json = False,
) -> None:
    """Reconstruct a measurement in a file: density, cumulative density, range, direct, indirect.

    Of a recording every frame is reconstructed; run again, it goes on where it stopped.
    """
    from pydantic import ValidationError

    from transientcam_server.cli import recordings
    from transientcam_server.offline import measurement as offline
    from transientcam_server.offline import plot as pictures
    from transientcam_server.settings import ReconstructionSettings

    if plot is not None:
        pictures.require()
    try:
        settings = ReconstructionSettings(
            smoothing_px=smoothing_px, bias=bias, return_threshold=threshold
        )
    except ValidationError as error:
        mistake = error.errors()[0]
        raise typer.BadParameter(f"{mistake['loc'][0]}: {mistake['msg']}") from error
    if recordings.is_recording(input):
        recordings.reconstruct_recording(
            input, output, products=product, settings=settings, bins=bins, as_json=as_json
        )
        return
    measurement = offline.load(
        input, frequency_hz=frequency_hz, harmonics=harmonics, background=background
    )
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        task = progress.add_task("reconstructing", total=None)

        def advance(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        result = offline.reconstruct(measurement, bins=bins, settings=settings, progress=advance)
        progress.update(task, description="writing")
        offline.save(output, result)
        if plot is not None:
            progress.update(task, description="drawing")
            pictures.save_picture(plot, result)
    if as_json:
        typer.echo(json.dumps(_document(measurement, result, output)))
    else:
        _tell(console, _document(measurement, result, output))


def _document(measurement: "Measurement", result: "Reconstruction", output: Path) -> dict[str, Any]:
    import numpy as np

    import transientcam_moments as tm

    height, width = result.flags.shape
    counts = {
        str(flag.name).lower(): int(np.count_nonzero(result.flags & flag.value))
        for flag in filter(None, tm.Flags)
    }
    return {
        "file": str(output),
        "width": width,
        "height": height,
        "harmonics": measurement.harmonics,
        "base_frequency_hz": measurement.base_frequency_hz,
        "times": result.time_s.size,
        "flagged": counts,
    }


def _tell(console: Console, document: dict[str, Any]) -> None:
    console.print(
        "{file}: {width} x {height} pixels, m = {harmonics} at ".format(**document)
        + f"{document['base_frequency_hz'] / 1e6:g} MHz, {document['times']} times of flight",
        soft_wrap=True,
    )
    for flag, count in document["flagged"].items():
        if count:
            console.print(f"  {count} pixels flagged {flag.replace('_', ' ')}")


def compile_kernels(
    harmonics: Annotated[
        list[int], typer.Option(min=1, max=32, help="Orders m to compile for; may be repeated.")
    ] = [3, 4, 8],  # noqa: B006 - typer copies it
    as_json: _Json = False,
) -> None:
    """Compile the kernels of the reconstruction now, for images and packages."""
    import transientcam_moments as tm

    if not tm.kernels.state()["enabled"]:
        if as_json:
            typer.echo(json.dumps(tm.kernels.state()))
        else:
            typer.echo("Kernels are off (TRANSIENTCAM_KERNELS); everything is left to NumPy.")
        return
    console = Console(stderr=as_json)
    with Progress(
        TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=console
    ) as progress:
        task = progress.add_task("compiling", total=None)

        def advance(done: int, total: int, name: str) -> None:
            progress.update(task, completed=done, total=total, description=name or "compiled")

        tm.kernels.compile(harmonics=harmonics, progress=advance)
    state = tm.kernels.state()
    if as_json:
        typer.echo(json.dumps(state))
    else:
        for failure in state["failed"]:
            console.print(f"failed: {failure}", soft_wrap=True)
        console.print(f"{len(state['compiled'])} kernels are ready.")
    if state["failed"]:
        raise typer.Exit(code=1)
