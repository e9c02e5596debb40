"""A writer that is killed: records into the file named first and prints what it acknowledged."""

import os
import sys
from pathlib import Path

from tests.server.recording.made import frame, header
from transientcam_server.recording import RecordingWriter


def main() -> None:
    """Record frames for ever; a line is printed after each that is written."""
    writer = RecordingWriter(Path(sys.argv[1]), header())
    frames = [frame(number) for number in range(64)]
    number = 0
    while True:
        writer.append(frames[number % 64])
        number += 1
        os.write(1, b"%d\n" % number)


if __name__ == "__main__":
    main()
