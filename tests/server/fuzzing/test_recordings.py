"""Crafted recordings do no harm: not to the process, not to the list, not to the good ones."""

import json
import os
import subprocess
import sys
from tempfile import TemporaryDirectory

import pytest

from tests.conftest import ROOT
from tests.server.fuzzing.damage import lookup3
from tests.server.fuzzing.recordings import KINDS, MEMORY_BYTES, in_memory

CASES = 40 * len(KINDS)
"""`python -m benchmarks fuzz_recordings` tries as many as there is time for."""


@pytest.mark.timeout(900)
def test_whatever_a_recording_is_it_is_listed_and_can_be_deleted() -> None:
    path = os.pathsep.join([str(ROOT), *sys.path])
    with TemporaryDirectory(dir=in_memory()) as directory:  # a disk would be waited for
        result = subprocess.run(
            [
                *(sys.executable, "-m", "tests.server.fuzzing.recordings", f"{directory}/tried"),
                *("0", str(CASES), "100"),
            ],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": path, "TRANSIENTCAM_KERNELS": "off"},
            capture_output=True,
            text=True,
            check=False,
        )
    outcomes = [json.loads(line) for line in result.stdout.splitlines() if '"kind"' in line]

    assert result.returncode == 0, result.stderr[-4000:]
    assert len(outcomes) == CASES
    assert not [each for each in outcomes if each["wrong"]]
    assert max(each["grown_bytes"] for each in outcomes) < MEMORY_BYTES
    for kind in KINDS:  # each did something
        assert {each["state"] for each in outcomes if each["kind"] == kind} - {"complete"}


def test_a_checksum_made_right_is_the_one_of_hdf5() -> None:
    # the values that come with the algorithm
    assert lookup3(b"") == 0xDEADBEEF
    assert lookup3(b"Four score and seven years ago") == 0x17770551
