"""Memory of large answers goes back to the system, in a process whose allocator is untouched."""

import ctypes
import os
import subprocess
import sys

import pytest

MIB = 2**20
PROGRAM = """
import ctypes, sys
from pathlib import Path
from transientcam_server.daemon._server import give_back_large_blocks

libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
libc.malloc.argtypes = (ctypes.c_size_t,)
libc.free.argtypes = (ctypes.c_void_p,)

def taken(size):
    block = libc.malloc(size)
    ctypes.memset(block, 1, size)
    return block

def resident():
    fields = Path("/proc/self/statm").read_text().split()
    return int(fields[1]) * 4096

if sys.argv[1] == "given back":
    give_back_large_blocks()
before = resident()
libc.free(taken(30 << 20))  # from now on glibc keeps blocks of this size
large = [taken(10 << 20) for _ in range(3)]
small = taken(1000)  # behind them, so that they cannot be cut off at the end
for block in large:
    libc.free(block)
print(resident() - before)
"""


def left_bytes(how: str) -> int:
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM, how],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    return int(result.stdout)


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallopt"), reason="it is for glibc's malloc")
def test_large_blocks_leave_nothing_behind() -> None:
    assert left_bytes("kept") > 8 * MIB
    assert left_bytes("given back") < 4 * MIB
