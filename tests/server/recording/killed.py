"""Writers that are killed: each records into the file that a line of the input names.

What was acknowledged is printed. Interpreter and libraries are loaded once: each writer is a
process of its own, forked before there is a thread or an open file of HDF5.
"""

import os
import sys
from pathlib import Path

from tests.server.recording.made import frame, header
from transientcam_server.recording import RecordingWriter


def write(path: Path) -> None:
    """Record frames for ever; a line is printed after each that is written."""
    writer = RecordingWriter(path, header())
    frames = [frame(number) for number in range(64)]
    number = 0
    while True:
        writer.append(frames[number % 64])
        number += 1
        os.write(1, b"%d\n" % number)


def main() -> None:
    """Start a writer for each path, print its process, and say when it has ended."""
    for line in sys.stdin:
        process = os.fork()
        if process == 0:
            try:
                write(Path(line.strip()))
            finally:
                os._exit(1)
        os.write(1, b"process %d\n" % process)
        _, status = os.waitpid(process, 0)
        os.write(1, b"ended by %d\n" % os.WTERMSIG(status))


if __name__ == "__main__":
    main()
