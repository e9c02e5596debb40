"""The verb ``plan`` of a running daemon: a job there, followed to its end."""

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from transientcam import Camera
from transientcam.cli.terminal import Terminal


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
        with _ends_by_signals() as told:
            job = start(**wanted)
            try:
                told.go_on()
                show(job)
                job = camera.wait_for(job["id"], on_progress=show)
            except (KeyboardInterrupt, SystemExit):
                camera.jobs.cancel(job["id"])
                raise
        if job["state"] == "cancelled":
            console.print("The job was cancelled.", style="red")
            raise typer.Exit(1)
        result: dict[str, Any] = job["result"]
        if map_file is None:
            return result, b""
        return result, camera.plan_map(job["id"], map_file.suffix[1:])


class _Told:
    """Which signal came; it ends nothing before there is a job to cancel."""

    def __init__(self) -> None:
        self._number: int | None = None
        self._held = True

    def take(self, number: int, _: object) -> None:
        """Handle a signal."""
        self._number = number
        if not self._held:
            raise SystemExit(128 + number)

    def go_on(self) -> None:
        """Let signals end the command from now on, also one that came before."""
        self._held = False
        if self._number is not None:
            raise SystemExit(128 + self._number)


@contextmanager
def _ends_by_signals() -> Iterator[_Told]:
    """Raise SystemExit where a signal would end the process at once."""
    told = _Told()
    numbers = [getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")]
    before = {
        number: signal.signal(number, told.take)
        for number in numbers
        if number is not None and signal.getsignal(number) is signal.SIG_DFL
    }
    try:
        yield told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
