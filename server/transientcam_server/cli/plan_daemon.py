"""The verb ``plan`` of a running daemon: a job there, followed to its end."""

from collections.abc import Mapping
from typing import Any

import typer

from transientcam import Camera
from transientcam.cli.terminal import Terminal


def by_daemon(
    url: str, token: str | None, parts: Mapping[str, Any] | None, console: Terminal
) -> dict[str, Any]:
    """Let a daemon plan for the scene before its camera; Ctrl-C cancels the job there, too.

    Parameters
    ----------
    parts
        Arguments of `Camera.start_plan`; None for the front.

    Raises
    ------
    ProblemError
        What the daemon refuses the plan with.
    """
    with Camera(url, token=token) as camera, console.status("waiting") as status:

        def show(job: Mapping[str, Any]) -> None:
            status.update(f"{job['progress']:.0%}: {job['step']}")

        job = camera.start_tradeoff() if parts is None else camera.start_plan(**parts)
        try:
            show(job)
            job = camera.wait_for(job["id"], on_progress=show)
        except KeyboardInterrupt:
            camera.jobs.cancel(job["id"])
            raise
        if job["state"] == "cancelled":
            console.print("The job was cancelled.", style="red")
            raise typer.Exit(1)
        result: dict[str, Any] = job["result"]
        return result
