"""The checks against a real daemon, which keeps every promise, and against one that does not."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from tests.conformance.breaking import NOTHING, Breaking
from tests.conformance.broken_promises import API, BROKEN, BROKEN_WITH_TOKENS
from tests.conformance.conftest import Breakable, breakable_daemon
from tests.serving import serving
from transientcam.cli import run as command
from transientcam.errors import ParameterError, PromiseBroken, ServerUnreachable
from transientcam.wire import LEASE_HEADER
from transientcam_conformance import (
    CHECKS,
    GROUPS,
    SLOW,
    Check,
    Device,
    Report,
    _recording as recording,
    chosen,
    run,
)
from transientcam_conformance._running import Rate, measured_rate
from transientcam_server.api import Role, utc_now
from transientcam_server.api._auth.tokens import TokenFile

LONG_S = 60.0
SHORT_S = 2.5
SILENCES = ("within", "no hello", "no notice", "no problem")
KEPT, HALF = Rate(10.0, 10.0), Rate(5.0, 10.0)
NO_TOKEN, TOO_SLOW = "the service requires no token", "the camera does not keep its rate"
TOO_BUSY = "a client misses frames without that other one, too"
BY_NAME = {each.name: each for each in CHECKS}


def only(name: str) -> tuple[Check, ...]:
    return (BY_NAME[name],)


def said(report: Report) -> str:
    return "; ".join(f"{each.check.name}: {each.reason}" for each in report.failed)


def test_the_daemon_keeps_every_promise(daemon: Breakable) -> None:
    with Device(daemon.served.url, timeout_s=LONG_S) as device:
        before = device.state()
        report = run(device)
        after = device.state()
        recordings = device.read(f"{API}/recordings")["recordings"]
        held = device.read(f"{API}/lease")["held"]

    assert not report.failed, said(report)
    assert len(report.results) == len(CHECKS) + 1
    # what rests on the camera's rate, or on a client's, is skipped where the machine is too slow
    for each in report.results:
        if each.outcome == "skipped":
            assert str(each.reason).startswith((NO_TOKEN, TOO_SLOW, TOO_BUSY))
    assert after == before
    assert not recordings
    assert not held


@contextmanager
def replayed_here(file: Path) -> Iterator[str]:
    """Replay a recording in this process, which starts sooner than another one."""
    with serving(f"recording:{file}?loop=on") as served:
        yield served.url


@pytest.mark.parametrize(("name", "breaking", "word"), BROKEN, ids=[each[0] for each in BROKEN])
def test_a_broken_promise_fails_its_check(
    breakable: Breakable, name: str, breaking: Breaking, word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "replayed", replayed_here)
    breakable.breaker.current = breaking
    # where nothing comes it is waited for as long
    timeout_s = SHORT_S if word in SILENCES else LONG_S
    with Device(breakable.served.url, timeout_s=timeout_s) as device:
        result = run(device, only(name), rate=lambda device: KEPT).results[0]

    assert (result.check.name, result.outcome) == (name, "failed"), result.reason
    assert word in str(result.reason)


@pytest.mark.parametrize(
    ("rate", "outcome"), [(HALF, "skipped"), (KEPT, "failed"), (PromiseBroken("none"), "failed")]
)
def test_what_rests_on_the_rate_is_not_failed_where_the_camera_does_not_keep_it(
    breakable: Breakable, rate: Rate | PromiseBroken, outcome: str
) -> None:
    name, breaking, _ = next(each for each in BROKEN if BY_NAME[each[0]].group == "stream")

    def measured(device: Device) -> Rate:
        if isinstance(rate, PromiseBroken):
            raise rate
        return rate

    breakable.breaker.current = breaking
    with Device(breakable.served.url, timeout_s=SHORT_S) as device:
        report = run(device, only(name), rate=measured)

    assert report.results[0].outcome == outcome
    said_so = f"{TOO_SLOW}: 5 of 10 frames/s arrive" in str(report.results[0].reason)
    assert said_so is (outcome == "skipped")
    assert (report.to_document()["slow"] is not None) is (outcome == "skipped")


def test_a_slow_camera_is_no_excuse_for_a_wrong_answer(breakable: Breakable) -> None:
    name, breaking, _ = next(each for each in BROKEN if BY_NAME[each[0]].group == "problems")
    breakable.breaker.current = breaking
    with Device(breakable.served.url, timeout_s=SHORT_S) as device:
        report = run(device, only(name), rate=lambda device: HALF)

    assert report.results[0].outcome == "failed"
    assert report.slow is None


def test_the_rate_is_that_of_frames_that_arrive(daemon: Breakable) -> None:
    with Device(daemon.served.url, timeout_s=LONG_S) as device:
        rate = measured_rate(device)
        assert rate.stated_hz == device.sequence["frame_rate_hz"]

    assert 0 < rate.delivered_hz < 1.5 * rate.stated_hz


def test_a_quick_run_leaves_out_whole_groups() -> None:
    groups = {each.group for each in chosen([], quick=True)}

    assert set(SLOW) < set(GROUPS)
    assert groups == set(GROUPS) - set(SLOW)
    assert {each.group for each in chosen([SLOW[0]], quick=True)} == {SLOW[0]}


def test_every_check_has_a_daemon_that_fails_it() -> None:
    broken = {name for name, _, _ in (*BROKEN, *BROKEN_WITH_TOKENS)}

    assert broken == set(BY_NAME)


def test_a_broken_promise_fails_no_other_check(breakable: Breakable) -> None:
    breaking = {name: breaking for name, breaking, _ in BROKEN}
    for name in ("a-wrong-method-is-a-problem", "an-unknown-product-is-a-problem"):
        breakable.breaker.current = breaking[name]
        with Device(breakable.served.url, timeout_s=LONG_S) as device:
            report = run(device, chosen(["problems"]))

        assert [each.check.name for each in report.failed] == [name]


def test_what_cannot_be_read_fails_a_check_and_ends_nothing(breakable: Breakable) -> None:
    breakable.breaker.current = Breaking(answer=lambda each: each.plain(200))
    with Device(breakable.served.url, timeout_s=SHORT_S) as device:
        report = run(device, chosen(["routes", "tags", "lease", "parameters"]))

    passed = [each.check.name for each in report.results if each.outcome == "passed"]
    assert passed == ["head-is-get-without-its-body"]  # which reads nothing
    assert not report.camera


@pytest.fixture(scope="module")
def guarded(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[Breakable, dict[Role, str]]]:
    """A daemon that requires tokens, and a token of each role."""
    path = tmp_path_factory.mktemp("tokens") / "tokens.json"
    tokens = {role: TokenFile(path).create(str(role), role, now=utc_now())[1] for role in Role}
    with breakable_daemon(
        tmp_path_factory.mktemp("recordings"), require_token=True, tokens_file=path
    ) as daemon:
        yield daemon, tokens


Guarded = tuple[Breakable, dict[Role, str]]


def test_with_tokens_the_promises_about_them_are_kept(guarded: Guarded) -> None:
    daemon, tokens = guarded
    with Device(daemon.served.url, token=tokens[Role.ADMIN], timeout_s=LONG_S) as device:
        report = run(device, chosen(["authentication", "stream"]))

    assert not report.failed, said(report)
    assert report.slow or report.counts["skipped"] == 0


@pytest.mark.parametrize(
    ("name", "breaking", "word"), BROKEN_WITH_TOKENS, ids=[each[0] for each in BROKEN_WITH_TOKENS]
)
def test_a_broken_promise_about_tokens_fails_its_check(
    guarded: Guarded, name: str, breaking: Breaking, word: str
) -> None:
    daemon, tokens = guarded
    daemon.breaker.current = breaking
    try:
        with Device(daemon.served.url, token=tokens[Role.ADMIN], timeout_s=LONG_S) as device:
            result = run(device, only(name), rate=lambda device: KEPT).results[0]
    finally:
        daemon.breaker.current = NOTHING

    assert result.outcome == "failed"
    assert word in str(result.reason)


def test_a_viewer_changes_nothing_and_gets_the_reason(guarded: Guarded) -> None:
    daemon, tokens = guarded
    with Device(daemon.served.url, token=tokens[Role.VIEWER], timeout_s=LONG_S) as device:
        report = run(device, chosen(["tags", "lease", "recording"]))

    assert not report.failed, said(report)
    reasons = {each.check.name: each.reason for each in report.results if each.reason}
    assert "viewer" in str(reasons["the-right-tag-changes-it"])
    assert "may not delete" in str(reasons["a-file-can-be-fetched-in-parts"])


def test_a_camera_that_another_client_controls_is_left_alone(daemon: Breakable) -> None:
    with Device(daemon.served.url, timeout_s=LONG_S) as device, httpx.Client() as other:
        address = f"{daemon.served.url}{API}/lease"
        lease = other.post(address, json={"holder": "bench 2"}).json()
        try:
            report = run(device, chosen(["tags", "lease"]))
        finally:
            other.delete(address, headers={LEASE_HEADER: lease["lease_id"]})

    reasons = [each.reason for each in report.results if each.outcome == "skipped"]
    assert not report.failed, said(report)
    assert reasons
    assert all("bench 2" in str(each) for each in reasons)


def test_a_camera_that_does_not_capture_does_not_afterwards(daemon: Breakable) -> None:
    with Device(daemon.served.url, timeout_s=LONG_S) as device:
        device.send("PUT", f"{API}/acquisition", json={"running": False})
        try:
            report = run(device, chosen(["resume"]))
            running = device.read(f"{API}/acquisition")["running"]
        finally:
            device.send("PUT", f"{API}/acquisition", json={"running": True})

    assert not report.failed, said(report)
    assert running is False


def test_a_daemon_that_is_not_there_is_said_at_once() -> None:
    with (
        Device("http://127.0.0.1:9", timeout_s=SHORT_S) as device,
        pytest.raises(ServerUnreachable),
    ):
        run(device)


def test_a_group_that_is_not_there_is_named() -> None:
    with pytest.raises(ParameterError, match="no-such"):
        chosen(["problems", "no-such"])


def test_every_check_states_a_promise_and_has_a_name_of_its_own() -> None:
    assert len(BY_NAME) == len(CHECKS)
    assert all(each.promise.endswith(".") for each in CHECKS)
    assert set(GROUPS) == {each.group for each in CHECKS}


def test_the_command_prints_a_line_a_check_and_writes_the_report(
    daemon: Breakable, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "report.json"
    url = daemon.served.url

    assert command(["conformance", url, "--only", "problems", "--json", str(file)]) == 0

    printed = capsys.readouterr().out
    document = json.loads(file.read_text())
    names = [each.name for each in chosen(["problems"])]
    assert [each["name"] for each in document["checks"][:-1]] == names
    assert all(name in printed for name in names)
    assert (document["passed"], document["failed"]) == (len(names) + 1, 0)
    assert document["camera"]["model"] in printed


def test_the_command_fails_and_says_what_is_broken(
    breakable: Breakable, capsys: pytest.CaptureFixture[str]
) -> None:
    breaking = {name: breaking for name, breaking, _ in BROKEN}
    breakable.breaker.current = breaking["an-unknown-product-is-a-problem"]
    url = breakable.served.url

    assert command(["conformance", url, "--only", "problems", "--json", "-"]) == 1

    captured = capsys.readouterr()
    (failed,) = (each for each in json.loads(captured.out)["checks"] if each["outcome"] == "failed")
    assert failed["name"] == "an-unknown-product-is-a-problem"
    assert failed["reason"] in captured.err
    assert failed["promise"] in captured.err


def test_the_command_refuses_a_group_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert command(["conformance", "http://127.0.0.1:9", "--only", "no-such"]) == 1

    assert "no-such" in capsys.readouterr().err
