"""``transientcam record``: record at the daemon, and download the file with ``--output``."""

import json
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from transientcam.camera import Camera
from transientcam.cli.options import JsonOption, TokenOption, UrlArgument, require_suffix
from transientcam.cli.terminal import echo, progress_bars

_LOOK_S = 0.5


def record(
    url: UrlArgument,
    name: Annotated[str | None, typer.Option(help="Name of the recording.")] = None,
    duration_s: Annotated[
        float | None, typer.Option("--duration", help="Stop after so many seconds.")
    ] = None,
    frames: Annotated[int | None, typer.Option(min=1, help="Stop after so many frames.")] = None,
    history_s: Annotated[
        float | None,
        typer.Option("--history", help="Begin with so many seconds that have just passed."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Also download the recording into this .h5."),
    ] = None,
    note: Annotated[str | None, typer.Option(help="Annotate the recording with this text.")] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record raw frames where the daemon runs, until the time is over or Ctrl-C."""
    require_suffix(output, ".h5", ".hdf5")
    annotations = None if note is None else {"note": note}
    with Camera(url, token=token) as camera, progress_bars(transient=True) as bars:
        running = camera.record(
            name=name,
            duration_s=duration_s,
            frames=frames,
            history_s=history_s,
            annotations=annotations,
        )
        try:
            bar = bars.add_task("recording", total=frames or duration_s)
            while running["state"] in ("recording", "finishing"):
                done = running["frames" if frames else "duration_s"]
                bars.update(bar, completed=done, description=_line(running))
                time.sleep(_LOOK_S)
                running = camera.recording(running["id"])
        except KeyboardInterrupt:  # the way to end it, not a failure
            running = camera.stop_recording(running["id"])
        if output is not None:
            bar = bars.add_task("downloading", total=None)
            camera.download_recording(
                running["id"],
                output,
                progress=lambda done, total: bars.update(bar, completed=done, total=total),
            )
    if as_json:
        echo(json.dumps(running))
    else:
        place = "" if output is None else f", downloaded into {output}"
        echo(f"{running['id']}: {_line(running)}{place}")
    if running["problem"] is not None:
        echo(f"transientcam: {running['problem']}", err=True)
        raise typer.Exit(code=1)


def _line(recording: dict[str, Any]) -> str:
    dropped = recording["dropped_frames"]
    return (
        f"{recording['frames']} frames, {recording['size_bytes'] / 1e6:.1f} MB, "
        f"{recording['duration_s']:.1f} s" + (f", {dropped} dropped" if dropped else "")
    )
