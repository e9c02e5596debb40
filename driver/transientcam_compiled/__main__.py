"""The other side of `ChildProcess`: calls what arrives, until this process's parent is gone."""

import ctypes
import os
import pickle
import queue
import resource
import signal
import sys
import threading
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final, NoReturn

_LOOK_EVERY_S: Final = 1.0
_IDLE_S: Final = 1.0
_PR_SET_PDEATHSIG: Final = 1


def serve(connection: Connection, parent: int) -> NoReturn:
    """Call what arrives, and send what it says and then what it returns or raises.

    The process ends with the other side, its parent. That is noticed while something is called,
    too: by the end of the connection, or by another parent, where a process of the other side has
    inherited its end.
    """
    received: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def receive() -> None:
        try:
            while os.getppid() == parent:
                if connection.poll(_LOOK_EVERY_S):
                    received.put(connection.recv_bytes())
        except (EOFError, OSError):
            pass
        os._exit(0)

    def send(kind: str, value: object) -> None:
        try:
            connection.send((kind, value))
        except OSError:  # nobody is there
            os._exit(0)

    def tell(value: object) -> None:
        send("told", value)

    threading.Thread(target=receive, daemon=True).start()
    inside, idle = pickle.loads(received.get())  # noqa: S301 - of this program
    with inside():
        while True:
            try:
                request = received.get(timeout=_IDLE_S)
            except queue.Empty:
                idle()
                continue
            try:
                function, arguments = pickle.loads(request)  # noqa: S301 - of this program
                send("returned", function(*arguments, tell))
            except Exception as error:
                send("raised", error)


def be_a_child(parent: int, memory_bytes: int, nice: int) -> None:
    """End with a parent, also where nothing here can run, and take from others what they leave.

    What the system refuses, as the sandbox of a service may, is left.
    """
    with suppress(OSError, AttributeError):  # not Linux
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it ended before that
        os._exit(0)
    with suppress(OSError):
        os.nice(nice)
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    with suppress(OSError, ValueError):  # less is allowed anyway
        status = Path("/proc/self/status").read_text().split()
        libraries_bytes = int(status[status.index("VmData:") + 1]) * 1024
        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (libraries_bytes + memory_bytes, most))


if __name__ == "__main__":
    _connection, _parent, _memory_bytes, _nice = map(int, sys.argv[1:])
    be_a_child(_parent, _memory_bytes, _nice)
    # Ctrl-C at a terminal is for the other side
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    serve(Connection(_connection), _parent)
