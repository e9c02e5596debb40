"""The verb ``plan`` of a running daemon: a job there, followed to its end."""

import signal
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import typer

from transientcam import Camera
from transientcam.cli.terminal import Terminal

_ENDING: Final = (signal.SIGTERM, signal.SIGHUP)


def by_daemon(
    url: str,
    token: str | None,
    wanted: Mapping[str, Any],
    console: Terminal,
    map_file: Path | None = None,
) -> tuple[dict[str, Any], bytes]:
    """Let a daemon plan for the scene before its camera, and return the plan and its map.

    Ctrl-C, SIGTERM and SIGHUP cancel the job there, too.

    Parameters
    ----------
    wanted
        Arguments of `Camera.start_plan`, or, without a target, of `Camera.start_tradeoff`.
    map_file
        Whose format a map is to have; None for none.

    Raises
    ------
    ProblemError
        What the daemon refuses the plan with.
    """
    with Camera(url, token=token) as camera, console.status("waiting") as status:

        def show(job: Mapping[str, Any]) -> None:
            status.update(f"{job['progress']:.0%}: {job['step']}")

        start = camera.start_plan if "target" in wanted else camera.start_tradeoff
        for number in _ENDING:
            signal.signal(number, lambda number, _: sys.exit(128 + number))
        signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)  # until there is a job to cancel
        job: dict[str, Any] = {}
        try:
            job = start(**wanted)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
            show(job)
            job = camera.wait_for(job["id"], on_progress=show)
        except (KeyboardInterrupt, SystemExit):
            if job:
                camera.jobs.cancel(job["id"])
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)
        if job["state"] == "cancelled":
            console.print("The job was cancelled.", style="red")
            raise typer.Exit(1)
        result: dict[str, Any] = job["result"]
        made = b"" if map_file is None else camera.plan_map(job["id"], map_file.suffix[1:])
        return result, made
