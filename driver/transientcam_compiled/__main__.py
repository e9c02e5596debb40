"""The other side of `ChildProcess`: calls what arrives, until this process's parent is gone."""

import os
import pickle
import queue
import signal
import sys
import threading
from multiprocessing.connection import Connection
from typing import Final, NoReturn

from transientcam_compiled._process import NICE

_LOOK_EVERY_S: Final = 1.0
_IDLE_S: Final = 1.0


def serve(connection: Connection) -> NoReturn:
    """Call what arrives, and send what it says and then what it returns or raises.

    The process ends with the other side. That is noticed while something is called, too: by the end
    of the connection, or by another parent, where a process of the other side has inherited its
    end.
    """
    received: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    parent = os.getppid()

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


if __name__ == "__main__":
    os.nice(NICE)
    # Ctrl-C at a terminal is for the other side
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    serve(Connection(int(sys.argv[1])))
