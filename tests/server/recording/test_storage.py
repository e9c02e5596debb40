"""What a file states about its sizes, and what that may cost."""

import os
import subprocess
import sys
from pathlib import Path

import h5py

from tests.server.fuzzing.damage import checked_blocks, lookup3

LISTED = """
import resource, sys
from pathlib import Path
from transientcam_server.recording import Library
from transientcam_server.settings import RecordingSettings

directory = Path(sys.argv[1])
library = Library(RecordingSettings(directory=directory), header=lambda *given: None)
resource.setrlimit(resource.RLIMIT_DATA, (1800 << 20, 1800 << 20))  # as LimitDATA= of the service
(listed,) = library.describe_all()
# not ru_maxrss, which begins with that of the process that was forked
status = Path("/proc/self/status").read_text()
peak_kb = int(status.split("VmHWM:")[1].split()[0])
print(listed["state"], peak_kb < 1 << 20)
"""


def test_a_text_that_states_a_length_of_4_gib_takes_no_memory_where_that_is_limited(
    tmp_path: Path,
) -> None:
    path = tmp_path / "forged.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["format"] = "x" * 349
    data = bytearray(path.read_bytes())
    at = data.index((349).to_bytes(4, "little"))
    for begin, end in checked_blocks(bytes(data)):
        if begin <= at < end:
            data[at : at + 4] = b"\xf0\xff\xff\xff"
            data[end : end + 4] = lookup3(bytes(data[begin:end])).to_bytes(4, "little")
    path.write_bytes(data)

    result = subprocess.run(
        [sys.executable, "-c", LISTED, str(tmp_path)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )

    assert result.stdout.split() == ["damaged", "True"]
