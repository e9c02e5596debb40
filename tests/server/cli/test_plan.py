"""The verb `transientcam plan` with a running daemon, and the front of all sequences."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any
from unittest import mock

import httpx
import pytest
from rich.progress import Progress, TaskID

from tests.server.planning.calls import Endless, Here
from tests.serving import Served, serving
from transientcam import Camera
from transientcam.cli import run

FEW = ["--fix", "harmonics=1", "--fix", "base_frequency_hz=23e6"]


@pytest.fixture(scope="module")
def daemon() -> Iterator[Served]:
    with serving("sim:wall?seed=2") as served:
        served.start_all_workers()
        # its own process has the lowest priority, and waits for all that a laden machine does
        with mock.patch.object(served.service.planning, "_process", Here()):
            yield served


@pytest.fixture
def kept(daemon: Served, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Keep looks and fronts for the whole test, however long that takes, and not for the next."""
    service = daemon.service
    service.fronts.forget()  # and looks with them
    for keeper in (service.fronts, service.looks):
        monkeypatch.setattr(keeper, "_clock", lambda: 0.0)
    yield
    service.fronts.forget()


@pytest.fixture
def few_families(daemon: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    """Search one family, so that a front takes a second."""
    families = import_module("transientcam_server.planning._search.families")  # not the function
    monkeypatch.setattr(families, "HARMONICS", (1,))


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The steps that the bar on standard error was given, and how far they are."""
    texts: list[str] = []

    def update(bars: Progress, task: TaskID, *, description: str, completed: float) -> None:
        texts.append(f"{completed:.0%}: {description}")

    monkeypatch.setattr(Progress, "update", update)
    return texts


def jobs_of(daemon: Served) -> list[dict[str, Any]]:
    with Camera(daemon.url) as camera:
        jobs: list[dict[str, Any]] = camera.jobs.all()["jobs"]
        return jobs


@pytest.mark.usefixtures("kept")
def test_a_daemon_plans_for_the_scene_before_its_camera(
    daemon: Served, shown: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    goal = ["--capture-s", "0.05", *FEW, "--estimator", "single-frequency"]

    assert run(["plan", "--daemon", daemon.url, *goal, "--json"]) == 0

    plan = json.loads(capsys.readouterr().out)
    assert plan["capture_s"] <= 0.05
    assert plan["scene"]["range_m"] == pytest.approx(2.0, abs=0.1)
    assert plan["sequence"]["harmonics"] == 1
    assert shown[-1].startswith("100%: ")

    assert run(["plan", "--daemon", daemon.url, *goal]) == 0
    first, *words = capsys.readouterr().out.splitlines()
    assert json.loads(first) == plan["sequence"]
    assert plan["summary"] in words
    half_time = next(line for line in words if line.startswith("half the time"))
    assert f"estimator {plan['half_time']['estimator']}:" in half_time


@pytest.mark.usefixtures("kept", "few_families")
def test_the_front_of_a_daemon_is_a_table_and_a_sentence(
    daemon: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["plan", "--daemon", daemon.url, "--front", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)

    assert run(["plan", "--daemon", daemon.url, "--front"]) == 0
    head, *rows, sentence = capsys.readouterr().out.splitlines()

    front = document["front"]
    assert len(rows) == len(front) > 3
    assert head.split()[:2] == ["time", "ms"]
    for row, choice in zip(rows, front, strict=True):
        time_ms, error_mm = (float(cell) for cell in row.split()[:2])
        error_m = choice["predicted"]["range_error_m"]["median"]
        assert time_ms == pytest.approx(choice["capture_s"] * 1e3, rel=1e-3)
        assert error_mm == pytest.approx(error_m * 1e3, rel=1e-2)
        assert row.endswith(choice["estimator"])
    assert sentence == document["summary"]


def test_the_front_of_a_given_scene_needs_no_daemon(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        import_module("transientcam_server.planning._search.families"), "HARMONICS", (1,)
    )

    assert run(["plan", "--front", "--brightness-dn-per-s", "8e5", "--json"]) == 0

    front = json.loads(capsys.readouterr().out)["front"]
    times_s = [each["capture_s"] for each in front]
    errors_m = [each["predicted"]["range_error_m"]["median"] for each in front]
    assert len(front) > 3
    assert times_s == sorted(times_s)
    assert errors_m == sorted(errors_m, reverse=True)


@pytest.mark.usefixtures("kept")
@pytest.mark.parametrize("what", ["plan", "tradeoff"])
def test_an_interrupt_cancels_the_job_of_the_daemon(
    what: str, daemon: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Endless()
    monkeypatch.setattr(daemon.service.planner, f"{what}_document", work)
    monkeypatch.setattr(daemon.service.planner, "look", lambda *_, **__: None)

    def interrupted(*_: object, **__: object) -> None:
        if work.began.is_set():
            raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "update", interrupted)
    goal = ["--front"] if what == "tradeoff" else ["--capture-s", "0.05", *FEW]

    try:
        assert run(["plan", "--daemon", daemon.url, *goal]) == 130
        assert work.ended.wait(60)
    finally:
        work.ended.set()

    with Camera(daemon.url) as camera:
        last = max(jobs_of(daemon), key=lambda job: float(job["created_at"]))
        assert last["kind"] == what
        assert camera.wait_for(last["id"])["state"] == "cancelled"


@pytest.mark.usefixtures("kept")
def test_a_command_that_is_ended_cancels_the_job_and_the_next_is_not_held_up(
    daemon: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Endless()
    monkeypatch.setattr(daemon.service.planner, "look", lambda *_, **__: None)
    main = "from transientcam.cli import main; main()"
    command = [sys.executable, "-c", main, "plan", "--daemon", daemon.url]

    with monkeypatch.context() as patched:
        patched.setattr(daemon.service.planner, "plan_document", work)
        with subprocess.Popen([*command, "--capture-s", "0.05"]) as ended:
            try:
                assert work.began.wait(60)
                ended.send_signal(signal.SIGTERM)
                assert work.ended.wait(60)
                assert ended.wait(60) == 128 + signal.SIGTERM
            finally:
                work.ended.set()
                ended.kill()
    goal = {"budget": {"capture_s": 0.05}, "scene": {"brightness_dn_per_s": 8e5}}
    goal |= {"fixed": {"harmonics": 1, "base_frequency_hz": 23e6}}
    next_plan = httpx.post(f"{daemon.url}/api/v1/plan", json=goal, timeout=60)
    assert next_plan.json()["capture_s"] <= 0.05
    last = max(jobs_of(daemon), key=lambda job: float(job["created_at"]))
    assert (last["kind"], last["state"]) == ("plan", "cancelled")


def test_what_a_daemon_refuses_is_printed_with_what_limits(
    daemon: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    goal = ["--range-error-m", "1e-9", *FEW]

    assert run(["plan", "--daemon", daemon.url, *goal]) == 1
    assert "What limits it" in capsys.readouterr().err

    assert run(["plan", "--daemon", daemon.url, *goal, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["field"] == "range_error_m"


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--daemon", "http://127.0.0.1:1", "--camera", "sim:wall"], "--camera"),
        (["--daemon", "http://127.0.0.1:1", "--real-time"], "--real-time"),
        (["--daemon", "http://127.0.0.1:1", "--ambient-dn-per-s", "0"], "--ambient-dn-per-s"),
        (["--front", "--range-error-m", "0.01"], "--range-error-m"),
        (["--front", "--fix", "harmonics=3"], "--fix"),
    ],
)
def test_options_that_contradict_each_other_are_refused_by_name(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["plan", *arguments]) == 2
    assert named in capsys.readouterr().err
