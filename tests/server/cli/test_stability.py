"""`transientcam stability`, through the command line of the client."""

import json
from pathlib import Path

import pytest

from tests.server.recording.made import record
from tests.serving import serving
from transientcam.cli import run


def test_a_recording_tells_its_best_averaging_time(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = str(record(tmp_path / "a.h5", 20))

    assert run(["stability", source, "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    assert run(["stability", source, "--frames", "17"]) == 0

    assert found["frames"] == 20
    assert found["averaging_s"] == pytest.approx([0.1, 0.2])
    assert 0 < found["pixels"] <= 16 * 12
    assert "The best averaging time is" in capfd.readouterr().out


def test_so_does_a_daemons_camera(capfd: pytest.CaptureFixture[str]) -> None:
    with serving("sim:wall?seed=2") as daemon:
        assert run(["stability", daemon.url, "--frames", "16"]) == 0

    assert "The best averaging time is" in capfd.readouterr().out
