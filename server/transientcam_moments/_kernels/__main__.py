"""The process that compiles lanes into the cache: of `transientcam_moments._lanes.helper`."""

import os
import queue
import signal
import sys
import threading
from multiprocessing.connection import Connection
from typing import Final

from transientcam_moments._kernels.compiler import compile_lane
from transientcam_moments._lanes.registry import Key

NICE: Final = 10
"""A tenth of the processor time beside others that need all of it, all that is left else."""
_LOOK_EVERY_S: Final = 1.0


def serve(connection: Connection) -> None:
    """Compile what arrives, and answer each lane; the process ends with the other side.

    That is seen while a lane is being compiled, too: by the end of the connection, or by another
    parent, where a process of the other side has inherited its end.
    """
    lanes: queue.Queue[str] = queue.Queue()
    parent = os.getppid()

    def receive() -> None:
        try:
            while os.getppid() == parent:
                if connection.poll(_LOOK_EVERY_S):
                    lanes.put(connection.recv_bytes().decode())
        except (EOFError, OSError):
            pass
        os._exit(0)

    threading.Thread(target=receive, daemon=True).start()
    while True:
        name, harmonics, precision = lanes.get().split()
        try:
            compile_lane(Key(name, int(harmonics), precision))
        except Exception as error:
            connection.send_bytes(str(error).encode())  # the other side finds the same by itself
        else:
            connection.send_bytes(b"")


if __name__ == "__main__":
    os.nice(NICE)
    # Ctrl-C at a terminal is for the other side
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    serve(Connection(int(sys.argv[1])))
