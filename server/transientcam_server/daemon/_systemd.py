"""Notifications to systemd: ready, alive, stopping (sd_notify(3), sd_watchdog_enabled(3)).

The protocol is one datagram of lines ``NAME=value`` to the socket that ``NOTIFY_SOCKET`` names;
the libraries for it are no shorter than this, and none of them was released for years.
"""

import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import AsyncIterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Final, Self

from transientcam_server.camera import Acquisition, AcquisitionStatus

_log = logging.getLogger("transientcam_server.daemon.systemd")

UNWATCHED_EVERY_S: Final = 10.0
"""How often the status line is renewed without a watchdog."""
ROUNDS_PER_WATCHDOG: Final = 3
"""How often we report within the time after which we would be restarted."""


@dataclass(frozen=True, slots=True)
class ServiceManager:
    """The service manager that started this process, if it accepts notifications."""

    address: str | None = None
    """Its socket: a path, or a name in Linux' abstract namespace (which begins with a zero); None
    where there is none."""
    watchdog_s: float | None = None
    """After how much silence it restarts this process; None for never."""

    @classmethod
    def of(cls, environment: Mapping[str, str], *, pid: int | None = None) -> Self:
        """Return the manager that started this process."""
        path = environment.get("NOTIFY_SOCKET", "")
        if not path.startswith(("/", "@")):
            return cls()
        address = "\0" + path[1:] if path.startswith("@") else path
        meant = environment.get("WATCHDOG_PID")
        microseconds = environment.get("WATCHDOG_USEC", "")
        if not microseconds.isdecimal() or (meant and meant != str(pid or os.getpid())):
            return cls(address)
        return cls(address, int(microseconds) * 1e-6 or None)

    @property
    def every_s(self) -> float:
        """How often it is notified."""
        if self.watchdog_s is None:
            return UNWATCHED_EVERY_S
        return min(UNWATCHED_EVERY_S, self.watchdog_s / ROUNDS_PER_WATCHDOG)

    def notify(self, **what: str) -> None:
        """Send variables; a manager that cannot be reached is no reason to stop."""
        if self.address is None:
            return
        lines = "\n".join(f"{name}={' '.join(value.split())}" for name, value in what.items())
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as sender:
                sender.setblocking(False)
                sender.sendto(lines.encode(), self.address)
        except OSError as error:
            _log.debug("the service manager cannot be notified: %s", error)


@contextlib.asynccontextmanager
async def supervised(acquisition: Acquisition, manager: ServiceManager) -> AsyncIterator[None]:
    """Report that the service is ready, then its state, until the block ends."""
    if manager.address is None:
        yield
        return
    manager.notify(READY="1", STATUS=status_line(acquisition.status()))
    reporting = asyncio.create_task(_report(acquisition, manager))
    try:
        yield
    finally:
        reporting.cancel()
        await asyncio.gather(reporting, return_exceptions=True)
        manager.notify(STOPPING="1")


async def _report(acquisition: Acquisition, manager: ServiceManager) -> None:
    pulse = Pulse(acquisition)
    while True:
        await asyncio.sleep(manager.every_s)
        status = acquisition.status()
        manager.notify(STATUS=status_line(status))
        if pulse.alive() and not status.stalled:
            manager.notify(WATCHDOG="1")


class Pulse:
    """Whether the thread that owns the camera still runs commands."""

    def __init__(self, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self._pending: Future[None] | None = None

    def alive(self) -> bool:
        """Return whether it has answered since the last call, and submit the next command."""
        if self._pending is not None and not self._pending.done():
            return False
        self._pending = self._acquisition.submit(lambda: None)
        return True


def status_line(status: AcquisitionStatus) -> str:
    """Return the state of the service in a few words.

    A camera that is gone, or was stopped on request, is nothing that a restart would mend: frames
    are missed only where they are wanted and could be had.
    """
    match status.state:
        case "lost":
            return f"the camera is lost: {status.reason}"
        case "arming":
            return "the light is announced and not on yet"
        case "stopped":
            return "the capture is stopped"
        case "calibrating":
            return "a calibration is being measured"
        case _ if status.stalled:
            return f"no frame for {status.frame_age_s:.0f} s"
        case "starting":
            return "the camera is starting"
        case _ if not status.frames:
            return "waiting for the first frame"
    rate = "" if status.rate_hz is None else f" at {status.rate_hz:.1f} Hz"
    return f"frame {status.frames}{rate}"
