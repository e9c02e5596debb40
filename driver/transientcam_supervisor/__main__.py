"""The process that switches the light off: ``python -m transientcam_supervisor FD PID SILENCE_S``.

FD is its end of a socket to the process PID, which owns the camera. The first byte of a message
says what it is: see `_supervisor`.
"""

import ctypes
import os
import select
import signal
import socket
import sys
import time
from typing import Final

from transientcam_supervisor._device import Device
from transientcam_supervisor._supervisor import (
    DARK,
    HEARD,
    NOT_READY,
    OFF_NOW,
    QUIT,
    READY,
    STARTING,
    SWITCH,
    SWITCHED_OFF,
)
from transientcam_supervisor._switch import OffSwitch

AGAIN_S: Final = 0.05
"""From one attempt to the next, until the light is known to be off."""
GIVE_UP_S: Final = 10.0
"""Without the owner: by then the camera is unplugged, or another owner has it."""
_MOST_BYTES: Final = 65536
_ENDING: Final = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT, signal.SIGQUIT)
_PRESENT_MEMORY: Final = 1  # MCL_CURRENT of mlockall(2)


class Watch:
    """Hears the owner of a camera, and switches its light off where it hears nothing.

    ``owner``: the socket to it.
    ``silence_s``: after so long without a message while the light may be on.
    """

    def __init__(self, owner: socket.socket, silence_s: float) -> None:
        self._owner = owner
        self._silence_s = silence_s
        self._device: Device | None = None
        self._start_s = 0.0
        self._due_s: float | None = None
        """When the next message, or the next attempt, is due."""
        self._held = False
        """Whether it was switched off here, and the owner has not said yet that it knows."""
        self._unsure = False
        """Whether it may still be on after the owner asked for it to be switched off."""

    def run(self, wake: int, process: int) -> None:
        """Watch until the owner says that it needs no more, or until the end of either process.

        ``wake``: is readable once this process was asked to end.
        ``process``: a file descriptor of the owner's process.
        """
        waiting = select.poll()
        for file in (self._owner.fileno(), wake, process):
            waiting.register(file, select.POLLIN)
        while True:
            left_s = None if self._due_s is None else max(0.0, self._due_s - time.monotonic())
            ready = dict(waiting.poll(None if left_s is None else left_s * 1e3 + 1))
            if wake in ready:
                if self._hold_off("the supervisor was ended") is not None:
                    self._off_without_owner()  # it may have ended, too
                return
            if self._owner.fileno() in ready:
                if not self._hear():
                    return
            elif process in ready:
                self._off_without_owner()
                return
            elif self._due_s is not None and time.monotonic() >= self._due_s:
                if self._unsure:
                    self._off()
                else:
                    self._hold_off(f"the supervisor heard nothing for {self._silence_s:g} s")

    def _hear(self) -> bool:
        """Act on a message; return whether to go on."""
        try:
            message = self._owner.recv(_MOST_BYTES)
        except ConnectionError:
            message = b""
        kind, content = message[:1], message[1:]
        if kind == SWITCH:
            self._open(content)
        elif kind == DARK:
            self._held = False
            self._expect(None)
            if self._device is not None:
                self._device.give_back()
        elif kind == QUIT:
            return False
        elif not kind:
            self._off_without_owner()
            return False
        elif kind == OFF_NOW:
            self._off()
        elif not self._held:  # else it does not know yet
            self._expect(self._silence_s + (self._start_s if kind == STARTING else 0.0))
        self._tell(HEARD)
        return True

    def _expect(self, within_s: float | None) -> None:
        self._unsure = False
        self._due_s = None if within_s is None else time.monotonic() + within_s

    def _open(self, content: bytes) -> None:
        switch = OffSwitch.unpack(content)
        if self._device is not None:
            self._device.close()
            self._device = None
        self._start_s = switch.start_s
        try:
            self._device = Device(switch)
        except OSError as error:
            self._tell(NOT_READY + str(error).encode())
        else:
            self._tell(READY)

    def _hold_off(self, reason: str) -> str | None:
        """Switch off, again and again until the owner knows; return why it may be on."""
        problem = None if self._device is None else self._device.switch_off()
        if not self._held:
            said = reason if problem is None else f"{reason}; it may be on: {problem}"
            self._tell(SWITCHED_OFF + said.encode())
        self._held = True
        self._due_s = time.monotonic() + AGAIN_S
        return problem

    def _off(self) -> None:
        """Switch off for an owner that cannot tell, and again until that has worked."""
        self._held = False  # it knows
        if self._device is not None:
            self._unsure = self._device.switch_off() is not None
            self._device.give_back()  # the owner looks for the camera meanwhile
            self._due_s = time.monotonic() + AGAIN_S if self._unsure else None

    def _off_without_owner(self) -> None:
        end_s = time.monotonic() + GIVE_UP_S
        while self._device is not None and self._device.switch_off() is not None:
            if time.monotonic() > end_s:
                return
            time.sleep(AGAIN_S)

    def _tell(self, message: bytes) -> None:
        try:
            self._owner.send(message, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except OSError:
            return  # stopped with a full queue, or gone


def main() -> None:
    """Watch the owner that the command line names."""
    owner = socket.socket(fileno=int(sys.argv[1]))
    wake, woken = os.pipe()
    os.set_blocking(woken, False)
    signal.set_wakeup_fd(woken)
    for each in _ENDING:
        signal.signal(each, lambda *_: None)
    # a page that has to come from a disk that hangs would come too late
    ctypes.CDLL(None).mlockall(_PRESENT_MEMORY)
    process = os.pidfd_open(int(sys.argv[2]))
    Watch(owner, float(sys.argv[3])).run(wake, process)


if __name__ == "__main__":
    main()
