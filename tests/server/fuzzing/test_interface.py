"""Requests that nobody thought of: every answer is one that the OpenAPI document has."""

import os
import re
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from tests.conformance.breaking import Breaker
from tests.conformance.broken_promises import with_status
from tests.conftest import ROOT
from tests.serving import serving

CONFIG = Path(__file__).with_name("schemathesis.toml")
PROGRAM = "from schemathesis.cli import schemathesis; schemathesis()"
ENDLESS = "mjpeg"


def fuzz(url: str, directory: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    """Run schemathesis against a daemon.

    It runs in a process of its own, as its plugin, hooks and threads are no business of the tests.
    """
    return subprocess.run(
        [
            *(sys.executable, "-c", PROGRAM, "--config-file", str(CONFIG)),
            *("run", f"{url}/openapi.json", "--no-color", "--exclude-path-regex", ENDLESS),
            *options,
        ],
        cwd=directory,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        capture_output=True,
        text=True,
        check=False,
    )


def test_every_answer_is_a_documented_one(tmp_path: Path) -> None:
    recordings = {"directory": tmp_path / "recordings", "min_free_bytes": 0}
    with serving("sim:wall?noise=off", recordings=recordings) as daemon:
        result = fuzz(daemon.url, tmp_path, "--exclude-path", "/api/v1/simulation/faults")
        with httpx.Client(base_url=daemon.url) as client:
            alive = client.get("/livez").status_code
            document = client.get("/openapi.json").json()

    assert result.returncode == 0, result.stdout + result.stderr
    operations = sum(len(methods) for methods in document["paths"].values())
    tested = re.search(r"Tested: (\d+)", result.stdout)
    assert tested is not None
    left_out = [path for path in document["paths"] if ENDLESS in path or path.endswith("/faults")]
    assert int(tested[1]) == operations - len(left_out)
    assert alive == 200


def test_a_camera_that_is_unplugged_answers_with_documented_problems(tmp_path: Path) -> None:
    recordings = {"directory": tmp_path / "recordings", "min_free_bytes": 0}
    with serving("sim:wall?noise=off", recordings=recordings) as daemon:
        with httpx.Client(base_url=daemon.url) as client:
            client.get("/api/v1/frames/latest", params={"wait_s": 10.0})
            client.post("/api/v1/simulation/faults", json={"fault": "unplug"})
        result = fuzz(
            daemon.url,
            tmp_path,
            *("--include-path-regex", "sequence|acquisition|camera|faults|readyz|frames/.frame.$"),
            *("--phases", "coverage"),
        )

    assert result.returncode == 0, result.stdout + result.stderr


def test_an_answer_that_is_not_documented_is_found(tmp_path: Path) -> None:
    breaker = Breaker()
    with serving(prepare=breaker.install) as daemon:
        fine = fuzz(daemon.url, tmp_path, "--include-path", "/api/v1/lease")
        breaker.current = with_status("/api/v1/lease", 418)
        broken = fuzz(daemon.url, tmp_path, "--include-path", "/api/v1/lease")

    assert fine.returncode == 0, fine.stdout
    assert broken.returncode == 1
    assert "418" in broken.stdout


pytestmark = pytest.mark.timeout(300)
