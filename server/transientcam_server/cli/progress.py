"""Progress bars of the verbs, on standard error."""

import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import typer
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from transientcam.cli.terminal import Terminal

if TYPE_CHECKING:
    from transientcam import Camera

_ENDING: Final = (signal.SIGTERM, signal.SIGHUP)


def progress_bars(*, console: Terminal | None = None, counted: bool = False) -> Progress:
    """Return bars for several tasks; ``counted`` shows "3/12" in place of a percentage."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn() if counted else TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console or Terminal(stderr=True),
    )


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show one bar; the caller reports progress to its value as (done, total)."""
    with progress_bars() as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


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
