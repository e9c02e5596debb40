import json
import signal
import subprocess
import sys
from pathlib import Path

import httpx

from tests.server.recording.made import record


def test_replay_serves_a_recording(tmp_path: Path) -> None:
    source = record(tmp_path / "a.h5", 3)
    with subprocess.Popen(
        [
            Path(sys.executable).with_name("transientcam"),
            "replay",
            source,
            "--loop",
            "--port",
            "0",
            "--json",
        ],
        stdout=subprocess.PIPE,
        text=True,
    ) as daemon:
        assert daemon.stdout is not None
        try:
            announced = json.loads(daemon.stdout.readline())
            assert announced["pid"] == daemon.pid
            url = announced["url"]
            answer = httpx.get(f"{url}/api/v1/frames/latest", params={"wait_s": 10}, timeout=60.0)
            assert answer.json()["width"] == 16
        finally:
            daemon.send_signal(signal.SIGTERM)
            daemon.stdout.read()
    assert daemon.returncode == 0
