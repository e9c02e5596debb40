"""A job of a daemon, shown on standard error until it is done."""

import signal
import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

import typer

from transientcam.cli.terminal import Terminal, progress_bars

if TYPE_CHECKING:
    from transientcam import Camera

_ENDING: Final = (signal.SIGTERM, signal.SIGHUP)


def followed(camera: "Camera", start: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """Start a job of a daemon and show it until it is done; signals that end this cancel it."""
    with progress_bars() as shown:
        task = shown.add_task("waiting", total=1.0)

        def show(job: Mapping[str, Any]) -> None:
            shown.update(task, description=job["step"], completed=job["progress"])

        for number in _ENDING:
            signal.signal(number, lambda number, _: sys.exit(128 + number))
        signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)  # until there is a job to cancel
        job: dict[str, Any] = {}
        try:
            job = start()
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
            job = camera.wait_for(job["id"], on_progress=show)
        except (KeyboardInterrupt, SystemExit):
            if job:
                camera.jobs.cancel(job["id"])
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
        show(job)
    if job["state"] == "cancelled":
        Terminal(stderr=True).print("The job was cancelled.", style="red")
        raise typer.Exit(code=1)
    return job
