"""Generated requests: every answer is one that the OpenAPI document has."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest import mock

import httpx
from fastapi import FastAPI

from tests.conformance.breaking import Answer, Breaker, Breaking
from tests.conformance.broken_promises import with_status
from tests.conftest import ROOT
from tests.serving import serving
from transientcam_server.service import Service

CONFIG = Path(__file__).with_name("schemathesis.toml")
PROGRAM = "from schemathesis.cli import schemathesis; schemathesis()"
ENDLESS = "mjpeg"
NOT_RECORDINGS = "mjpeg|calibrations|jobs|frames|camera$"
STILL_THERE = "Deleted resource still available"
ALL_PHASES = "examples,coverage,fuzzing"


def fuzz(
    url: str, directory: Path, *options: str, phases: str = ALL_PHASES
) -> "subprocess.CompletedProcess[str]":
    """Run schemathesis against a daemon, one request at a time."""
    # made with the first request; schemathesis waits 10 s for it, which a busy machine exceeds
    httpx.get(f"{url}/openapi.json", timeout=60.0).raise_for_status()
    return in_its_own_process(
        *("-c", PROGRAM, "--config-file", str(CONFIG)),
        *("run", f"{url}/openapi.json", "--no-color", "--exclude-path-regex", ENDLESS),
        *("--phases", phases),
        *options,
        directory=directory,
    )


def tell_stories(url: str, directory: Path, *how: str) -> "subprocess.CompletedProcess[str]":
    """Let requests follow from answers."""
    program = "tests.server.fuzzing.stateful"
    return in_its_own_process("-m", program, url, *how, directory=directory)


def in_its_own_process(*arguments: str, directory: Path) -> "subprocess.CompletedProcess[str]":
    """Run Python: plugins, hooks and threads of schemathesis are no business of the tests.

    Which characters there are is found out once for all tests, and again in every session.
    """
    kept = {"HYPOTHESIS_STORAGE_DIRECTORY": str(directory.parent / "hypothesis")}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=directory,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])} | kept,
        capture_output=True,
        text=True,
        check=False,
    )


def staying(app: FastAPI) -> None:
    """Have a camera that was opened in the place of the one that is served closed again."""
    service: Service = app.state.service
    change = service.change_camera

    async def change_and_stay(spec: str) -> None:
        with mock.patch.object(service.acquisition, "stop"):  # or nothing would be served after it
            await change(spec)
        assert service.successor is not None
        service.successor[1].close()
        service._successor = None

    vars(service)["change_camera"] = change_and_stay


def test_every_answer_is_a_documented_one(tmp_path: Path) -> None:
    recordings = {"directory": tmp_path / "recordings", "min_free_bytes": 0}
    with serving("sim:wall?noise=off", prepare=staying, recordings=recordings) as daemon:
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
            phases="coverage",
        )

    assert result.returncode == 0, result.stdout + result.stderr


def test_an_answer_that_is_not_documented_is_found(tmp_path: Path) -> None:
    breaker = Breaker()
    with serving(prepare=breaker.install) as daemon:
        breaker.current = with_status("/api/v1/lease", 418)
        broken = fuzz(
            daemon.url, tmp_path, "--include-path", "/api/v1/lease", phases="examples,coverage"
        )

    assert broken.returncode == 1
    assert "418" in broken.stdout


def test_what_was_made_is_there_until_it_is_deleted(tmp_path: Path) -> None:
    recordings = {"directory": tmp_path / "recordings", "min_free_bytes": 0}
    with serving("sim:wall?noise=off", recordings=recordings) as daemon:
        result = tell_stories(daemon.url, tmp_path)

    assert result.returncode == 0, result.stderr
    story = json.loads(result.stdout)
    assert story["wrong"] == []
    recording, job = "/api/v1/recordings/{recording}", "/api/v1/jobs/{job}"
    for each in (
        "POST /api/v1/recordings 201",
        f"GET {recording} 200",
        f"PATCH {recording} 200",
        f"POST {recording}/stop 200",
        f"GET {recording}/file 200",
        f"GET {recording}/frames/{{frame}} 200",
        f"DELETE {recording} 200",
        f"GET {recording} 404",
        "POST /api/v1/calibrations 202",
        f"GET {job} 200",
        f"POST {job}/cancel 200",
    ):
        assert story["answers"].get(each), f"{each} never came about"


def said_to_be_deleted(answer: Answer) -> Answer:
    """Call everything deleted, also what cannot be, as a recording that still runs."""
    return replace(answer, status=200) if answer.method == "DELETE" else answer


def test_something_deleted_that_can_still_be_had_is_found(tmp_path: Path) -> None:
    recordings = {"directory": tmp_path / "recordings", "min_free_bytes": 0}
    breaker = Breaker()
    with serving("sim:wall?noise=off", prepare=breaker.install, recordings=recordings) as daemon:
        breaker.current = Breaking(answer=said_to_be_deleted)
        result = tell_stories(daemon.url, tmp_path, NOT_RECORDINGS, STILL_THERE)

    assert result.returncode == 0, result.stderr
    assert any(STILL_THERE in each for each in json.loads(result.stdout)["wrong"])
