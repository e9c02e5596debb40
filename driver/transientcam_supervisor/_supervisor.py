"""The owner's side: starts the process, and says that the light is under control."""

import os
import socket
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from transientcam_supervisor._switch import OffSwitch

ALIVE: Final = b"+"
"""The light may be on, and the owner controls it."""
STARTING: Final = b"s"
"""The light is about to be switched on."""
DARK: Final = b"-"
"""The light is off."""
OFF_NOW: Final = b"!"
"""The owner cannot tell whether the light is off; behind it, why."""
SWITCH: Final = b"="
"""An off switch, packed."""
QUIT: Final = b"q"
"""The light is off, and there will be none."""

HEARD: Final = b"."
READY: Final = b"r"
NOT_READY: Final = b"n"
SWITCHED_OFF: Final = b"o"
"""Switched off, or tried; behind it, why."""

_ANSWERS_S: Final = 5.0
"""A new process takes a twentieth of a second, on a machine that has the time."""
_MOST_BYTES: Final = 4096


def since_boot_s() -> float:
    """Return a time that goes on while the machine sleeps, where the system has one (Linux)."""
    boot: int | None = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


class SupervisorEnded(OSError):  # noqa: N818 - says what has happened
    """The process cannot be started, is gone, or cannot reach the camera."""


class Supervisor:
    """A process that switches a light off where it does not hear from this one. For one thread.

    ``program``: the Python to start; None where there is none to start.
    ``silence_s``: after so long without a word while the light may be on. It is given up where it
    says nothing for twice as long.
    ``clock``: monotonic time in s, of the machine's sleep too.
    """

    def __init__(
        self, program: str | None, *, silence_s: float, clock: Callable[[], float] = since_boot_s
    ) -> None:
        self._program = program
        self._silence_s = silence_s
        self._clock = clock
        self._process: subprocess.Popen[bytes] | None = None
        self._switch: OffSwitch | None = None
        self._asked_s: float | None = None
        """When the oldest message was sent that is not answered."""
        self._alive_s: float | None = None

    @property
    def pid(self) -> int | None:
        """The process, where there is one."""
        return None if self._process is None else self._process.pid

    def watch(self, switch: OffSwitch) -> None:
        """Let it watch a camera by this switch from now on; it is started where there is none.

        Raises SupervisorEnded where it cannot be started, or cannot reach the camera.
        """
        if self._process is not None and switch == self._switch:
            return
        if self._process is None:
            self._start()
        self._switch = None
        self._link.settimeout(_ANSWERS_S)
        try:
            self._link.send(SWITCH + switch.pack())
            answer = self._link.recv(_MOST_BYTES)
            while answer[:1] not in (READY, NOT_READY, b""):
                answer = self._link.recv(_MOST_BYTES)
        except OSError as error:
            self.end()
            raise SupervisorEnded(f"the supervisor does not answer: {error}") from error
        if answer[:1] != READY:
            self.end()
            reason = answer[1:].decode() or "it has ended"
            raise SupervisorEnded(f"the supervisor cannot reach the camera: {reason}")
        self._switch = switch
        self._asked_s = None

    def starting(self) -> str | None:
        """Say that the light is about to be switched on; as `alive`."""
        self._alive_s = None
        return self._say(STARTING)

    def alive(self) -> str | None:
        """Say that the light may be on, and is under control; never waits.

        Returns why the light was switched off by the supervisor, where it was, which goes on with
        that until `dark`.
        Raises SupervisorEnded where it is gone, or answers nothing: it was stopped.
        """
        now_s = self._clock()
        pause_s = 0.0 if self._alive_s is None else now_s - self._alive_s
        self._alive_s = now_s if self._process is not None else None
        reason = self._say(ALIVE)
        if reason is None and pause_s > self._silence_s:  # both were stopped, as with the machine
            return f"the light was out of control for {pause_s:.1f} s"
        return reason

    def dark(self) -> str | None:
        """Say that the light is off; as `alive`."""
        self._alive_s = None
        return self._say(DARK)

    def switch_off(self) -> str | None:
        """Let it switch off what may be on; as `alive`."""
        self._alive_s = None
        return self._say(OFF_NOW)

    def _say(self, message: bytes) -> str | None:
        """Send a message, unless it says itself that the light went off: return why, then."""
        if self._process is None:
            return None
        try:
            reason = self._news()
            if reason is not None:
                return reason
            try:
                self._link.send(message)
            except ConnectionError:  # its last words may have come meanwhile
                return self._news()
        except OSError as error:
            self.end()
            raise SupervisorEnded(f"the supervisor has ended: {error}") from error
        if self._asked_s is None:
            self._asked_s = self._clock()
        return None

    def end(self) -> None:
        """Kill it, and wait until it has ended."""
        process, self._process = self._process, None
        if process is not None:
            self._link.close()
            process.kill()
            process.wait()

    def close(self, *, dark: bool) -> None:
        """Let it end: at once where the light is off, else once it has switched it off."""
        process, self._process = self._process, None
        if process is not None:
            with self._link:
                if dark:
                    with suppress(OSError):  # it has ended
                        self._link.send(QUIT)
            try:
                process.wait(_ANSWERS_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def _news(self) -> str | None:
        """Read what it said; return why the light went off."""
        self._link.setblocking(False)
        while True:
            try:
                said = self._link.recv(_MOST_BYTES)
            except BlockingIOError:
                patience_s = 2 * self._silence_s
                if self._asked_s is not None and self._clock() - self._asked_s > patience_s:
                    raise TimeoutError(f"no answer for {patience_s:g} s") from None
                return None
            except ConnectionResetError:  # it left something unread; its own words are there
                continue
            if not said:
                raise ConnectionResetError("its end of the connection is closed")
            self._asked_s = None
            if said[:1] == SWITCHED_OFF:
                return said[1:].decode()

    def _start(self) -> None:
        if self._program is None:
            raise SupervisorEnded("there is no Python to start a supervisor with")
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        package = Path(__file__).parents[1]
        # -S: nothing of what is installed; -P: nothing of the directory that the program runs in
        command = [self._program, "-S", "-P", "-m", "transientcam_supervisor"]
        try:
            with theirs:
                self._process = subprocess.Popen(  # noqa: S603 - this program
                    [*command, str(theirs.fileno()), str(os.getpid()), str(self._silence_s)],
                    env=os.environ | {"PYTHONPATH": str(package)},
                    pass_fds=(theirs.fileno(),),
                    stdin=subprocess.DEVNULL,
                    start_new_session=True,  # Ctrl-C at a terminal is for this one
                )
        except OSError as error:
            ours.close()
            raise SupervisorEnded(f"the supervisor cannot be started: {error}") from error
        self._link = ours
