"""The camera for LeRobot, made and read as LeRobot does, in a process that has LeRobot."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.serving import serving

_LEROBOT = ROOT / "build" / "lerobot"


@pytest.mark.skipif(not _LEROBOT.is_dir(), reason="make .venv/test.stamp installs LeRobot there")
def test_lerobot_reads_the_pictures_and_depths_of_the_service() -> None:
    paths = [_LEROBOT, ROOT / "examples" / "lerobot_camera_transientcam"]
    program = Path(__file__).with_name("lerobot_reading.py")
    with serving("sim:mirrors?noise=off") as daemon:
        done = subprocess.run(
            [sys.executable, program, daemon.url],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths))},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    assert (done.returncode, done.stdout) == (0, "read"), done.stderr
