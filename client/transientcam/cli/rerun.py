"""``transientcam rerun``: a camera's frames, live or as a file, in Rerun."""

import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Final

import rerun as rr
import typer

from transientcam.camera import Camera
from transientcam.cli.options import JsonOption, TokenOption, UrlArgument, require_suffix
from transientcam.cli.showing import shown_on
from transientcam.cli.terminal import Terminal
from transientcam.robotics import BINS, LOGGED, RerunBridge, blueprint

_HERE: Final = "rerun+http://127.0.0.1:9876/proxy"


def rerun(
    url: UrlArgument,
    products: Annotated[
        list[str] | None, typer.Argument(help=f"Products to send; default: {', '.join(LOGGED)}.")
    ] = None,
    spawn: Annotated[
        bool,
        typer.Option(
            "--spawn",
            help="Start a viewer on this machine (the default, but with a token to be said: every "
            "user of the machine can read what a viewer shows).",
        ),
    ] = False,
    connect: Annotated[
        str | None, typer.Option(metavar="URL", help=f"A viewer that runs, such as {_HERE}.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(metavar="FILE.rrd", help="Write a file for the viewer.")
    ] = None,
    count: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many frames of the first product.")
    ] = None,
    max_rate_hz: Annotated[float, typer.Option(min=0.01, help="Maximum frames per second.")] = 10.0,
    transient_rate_hz: Annotated[
        float, typer.Option(min=0.01, help="Maximum transients per second; they are large.")
    ] = 1.0,
    bins: Annotated[
        int, typer.Option(min=2, max=1024, help="How many times of flight a transient has.")
    ] = BINS,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show a camera live in Rerun, or write what it shows into a file, until interrupted.

    It only subscribes.
    """
    require_suffix(save, ".rrd", hint="--save")
    somewhere = spawn or connect is not None or save is not None
    if token is not None and not somewhere:
        message = "a viewer asks nobody for a token: say --spawn, --connect or --save"
        raise typer.BadParameter(message, param_hint="--token")
    console = Terminal(stderr=True)
    with Camera(url, token=token) as camera, rr.RecordingStream("transientcam") as recording:
        bridge = RerunBridge(
            camera,
            recording,
            products=products or LOGGED,
            max_rate_hz=max_rate_hz,
            transient_rate_hz=transient_rate_hz,
            bins=bins,
            on_report=shown_on(console, as_json=as_json),
        )
        _open(recording, spawn=spawn or not somewhere, to=connect, file=save)
        with bridge, suppress(KeyboardInterrupt):  # the way to end it, not a failure
            bridge.run(count)
        recording.disconnect()


def _open(recording: rr.RecordingStream, *, spawn: bool, to: str | None, file: Path | None) -> None:
    """Set where a recording goes.

    Raises OSError if the file cannot be written, no viewer can be started, or the address is none
    of one.
    """
    sinks: list[rr.GrpcSink | rr.FileSink] = []
    try:
        if spawn:
            _start_viewer()
            sinks.append(rr.GrpcSink(_HERE))
        if to not in (None, _HERE if spawn else None):
            sinks.append(rr.GrpcSink(to))
        if file is not None:
            sinks.append(rr.FileSink(file))
        recording.set_sinks(*sinks, default_blueprint=blueprint())
    except RuntimeError as error:
        raise OSError(None, f"cannot send to Rerun ({error})") from error


def _start_viewer() -> None:
    """Start a viewer that outlives this program; the SDK's `spawn` serves the whole network."""
    address = ["--bind", "127.0.0.1", "--port", "9876"]
    shown = ["--hide-welcome-screen", "--expect-data-soon"]
    command = [sys.executable, "-m", "rerun_cli", *address, *shown]
    subprocess.Popen(command, start_new_session=True)  # noqa: S603 - no word of it is from elsewhere
