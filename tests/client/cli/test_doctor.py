"""`transientcam doctor`: its verdict, and what it says of a daemon."""

import json
import sys
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime, timedelta
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import trustme
from websockets.http11 import Response
from websockets.sync.server import ServerConnection

from tests.client.conftest import ReplayServer
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam import Camera
from transientcam.cli import daemon_checks, findings, run
from transientcam.cli.findings import Finding, Reported

_Offer = Callable[[Iterable[Reported]], None]


@pytest.fixture(scope="module")
def daemon() -> Iterator[Served]:
    with serving("sim:wall?noise=off") as served:
        served.start_all_workers()
        with Camera(served.url, timeout_s=60.0) as camera:
            camera.latest(wait_s=10.0)
        yield served


@pytest.fixture
def offer(monkeypatch: pytest.MonkeyPatch) -> _Offer:
    """Let the only installed package find what a test says."""

    def make(found: Iterable[Reported]) -> None:
        module = ModuleType("checks_of_a_test")
        module.checks = lambda config: found  # type: ignore[attr-defined]  # a module made here
        monkeypatch.setitem(sys.modules, "checks_of_a_test", module)
        point = EntryPoint("test", "checks_of_a_test:checks", findings.GROUP)
        monkeypatch.setattr(findings, "entry_points", lambda group: [point])

    return make


def report(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    code = run(["doctor", "--json", *arguments])
    return code, json.loads(capsys.readouterr().out)


def of(document: dict[str, Any], check: str) -> dict[str, Any]:
    found: dict[str, Any] = next(each for each in document["findings"] if each["check"] == check)
    return found


@pytest.mark.parametrize(
    ("level", "code", "verdict"),
    [("ok", 0, "ok"), ("warning", 0, "warning"), ("fault", 1, "fault")],
)
def test_only_a_fault_fails(
    offer: _Offer, capsys: pytest.CaptureFixture[str], level: str, code: int, verdict: str
) -> None:
    offer([("ok", "first", "fine", None), (level, "second", "seen", "do something")])

    found, document = report(capsys)

    assert (found, document["verdict"]) == (code, verdict)
    assert document["findings"][-1] == {
        "level": level,
        "check": "second",
        "message": "seen",
        "remedy": "do something",
    }


def test_each_finding_is_a_line_and_each_remedy_below_it(
    offer: _Offer, capsys: pytest.CaptureFixture[str]
) -> None:
    offer([("fault", "udev rule", "[there] is none", "first line\nsecond line")])

    assert run(["doctor"]) == 1

    lines = capsys.readouterr().out.splitlines()
    assert lines[-4:] == [
        "fault   udev rule    [there] is none",
        "                     first line",
        "                     second line",
        "ok: 2, warning: 0, fault: 1, not tried: 0.",
    ]


def test_a_check_that_fails_is_a_fault_and_ends_nothing_else(
    offer: _Offer, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> Iterator[Reported]:
        yield "ok", "first", "fine", None
        raise ZeroDivisionError("by zero")

    offer(broken())

    code, document = report(capsys)

    assert code == 1
    assert of(document, "first")["level"] == "ok"
    assert "ZeroDivisionError: by zero" in of(document, "test")["message"]


def test_a_package_that_is_not_installed_is_no_fault(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    point = EntryPoint("server", "package_that_is_not_there:checks", findings.GROUP)
    monkeypatch.setattr(findings, "entry_points", lambda group: [point])

    code, document = report(capsys)

    assert (code, document["not_tried"]) == (0, ["server"])
    assert "transientcam[server]" in of(document, "server")["remedy"]


def test_the_settings_file_reaches_the_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.toml"
    file.write_text("bogus = 1\n")

    code, document = report(capsys, "--config", str(file))

    assert code == 1
    assert "bogus" in of(document, "settings")["message"]


def test_a_daemon_that_streams_is_in_order(
    daemon: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    code, document = report(capsys, daemon.url, "--seconds", "1")

    assert code == 0
    checked = [each["check"] for each in document["findings"]]
    of_daemon = ["reachable", "versions", "ready", "clock", "camera", "products", "stream"]
    assert checked[2:] == of_daemon
    assert {of(document, each)["level"] for each in checked[2:-1]} == {"ok"}
    assert "SIM-" in of(document, "camera")["message"]
    assert of(document, "products")["message"] == "all of them can be had"
    assert of(document, "stream")["message"].startswith("range at ")


def test_a_stopped_capture_is_a_warning_that_says_how_to_start_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with serving("sim:wall?noise=off") as served:
        served.service.acquisition.set_running(False).result()
        code, document = report(capsys, served.url)

    assert code == 0
    assert of(document, "stream")["level"] == "warning"
    assert "acquisition" in of(document, "stream")["remedy"]


def test_an_unplugged_camera_is_a_fault(capsys: pytest.CaptureFixture[str]) -> None:
    with serving("sim:wall?noise=off") as served:
        assert served.camera.simulation is not None
        served.camera.simulation.unplug()
        wait_until(lambda: served.service.acquisition.status().state == "lost")
        code, document = report(capsys, served.url)

    assert code == 1
    assert of(document, "ready")["level"] == "fault"
    assert of(document, "camera")["level"] == "fault"


def test_without_a_required_token_the_remedy_names_the_option(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("TRANSIENTCAM_TOKEN", raising=False)
    with serving(
        "sim:wall?noise=off", require_token=True, tokens_file=tmp_path / "tokens.json"
    ) as served:
        code, document = report(capsys, served.url)

    assert code == 1
    assert "--token" in of(document, "access")["remedy"]


def test_no_answer_from_the_address_is_a_fault_and_the_end(
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, document = report(capsys, "127.0.0.1:1", "--timeout-s", "2")

    assert code == 1
    assert document["findings"][-1]["check"] == "reachable"
    assert "transientcam serve" in document["findings"][-1]["remedy"]


def test_another_program_at_the_address_is_a_fault(
    replay: Callable[..., ReplayServer], capsys: pytest.CaptureFixture[str]
) -> None:
    def not_found(connection: ServerConnection, request: object) -> Response:
        return connection.respond(404, "nothing here")

    server = replay(lambda connection: None, process_request=not_found)

    code, document = report(capsys, server.url)

    assert code == 1
    assert "no transientcam (status 404)" in document["findings"][-1]["message"]


@pytest.mark.parametrize(("days", "level"), [(60, "ok"), (5, "warning")])
def test_a_certificate_that_ends_soon_is_a_warning(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    days: int,
    level: str,
) -> None:
    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1", not_after=datetime.now(UTC) + timedelta(days=days))
    authority.cert_pem.write_to_path(tmp_path / "authority.pem")
    issued.private_key_and_cert_chain_pem.write_to_path(tmp_path / "both.pem")
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "authority.pem"))
    with serving("sim:wall?noise=off", tls_certificate=tmp_path / "both.pem") as served:
        _, document = report(capsys, served.url, "--seconds", "0.2")

    assert of(document, "reachable")["level"] == "ok"
    assert of(document, "certificate")["level"] == level


@pytest.mark.parametrize(
    ("there", "level", "words"),
    [
        ("Fri, 20 Nov 2026 10:00:00 GMT", "ok", "agrees"),
        ("Fri, 20 Nov 2026 10:00:01 GMT", "ok", "agrees"),
        ("Fri, 20 Nov 2026 10:01:00 GMT", "warning", "60 s ahead of"),
        ("Fri, 20 Nov 2026 09:59:00 GMT", "warning", "59 s behind"),
        ("yesterday", "warning", "does not say"),
        (None, "warning", "does not say"),
    ],
)
def test_the_daemon_s_clock_is_compared_as_far_as_its_seconds_allow(
    there: str | None, level: str, words: str
) -> None:
    ten_s = 1795168800.2  # 2026-11-20 10:00:00.2 UTC

    found: Finding = daemon_checks._clock(there, ten_s, ten_s + 0.1)

    assert found.level == level
    assert words in found.message


def test_a_report_for_an_issue_holds_findings_and_no_path_or_host_of_the_user(
    offer: _Offer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/somebody")
    monkeypatch.setattr("platform.node", lambda: "my-laptop")
    offer([("warning", "disk", "/home/somebody/light on my-laptop is ```full", None)])

    code = run(["doctor", "--json", "--report", str(tmp_path / "camera.md")])

    written = (tmp_path / "camera.md").read_text("utf-8")
    assert code == 0
    assert "- warning, disk: ~/light on HOST is '''full" in written
    assert written.count("```") == 2
    assert "What I did" in written
