"""A relay before a real origin, both with their own ports: what its clients see and may do."""

import re
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import pytest

import transientcam
from tests.server.relay.forwarder import forwarding
from tests.server.streaming import VIDEO
from tests.serving import Served, serving
from tests.waiting import wait_until
from transientcam_driver import CameraLost
from transientcam_server.api import utc_now
from transientcam_server.api._auth import Role
from transientcam_server.api._auth.tokens import TokenFile
from transientcam_server.recording import Recording
from transientcam_server.relay import Origin, RelayCamera
from transientcam_server.relay._plugin import TOKEN_VARIABLE

ORIGIN = "sim:wall?noise=off"
PATIENCE_S = 60.0


def read_until(stream: transientcam.Stream, wanted: Any) -> transientcam.Frame:
    """Return the next frame that is wanted."""
    while True:
        frame = stream.receive(timeout_s=PATIENCE_S)
        if wanted(frame):
            return frame


def acquisition_until(camera: transientcam.Camera, *, running: bool) -> dict[str, Any]:
    """Return the acquisition once it captures, or does not."""
    wait_until(lambda: camera.acquisition["running"] is running)
    return camera.acquisition


@pytest.fixture(scope="module")
def origin() -> Iterator[Served]:
    with serving(ORIGIN, sequence=VIDEO, history={"seconds": 60.0}) as daemon:
        daemon.start_all_workers()
        yield daemon


@pytest.fixture(scope="module")
def relay(origin: Served) -> Iterator[Served]:
    with serving_relay(origin.url) as daemon, transientcam.Camera(daemon.url) as camera:
        daemon.start_all_workers()
        camera.latest(wait_s=10.0)  # its stream stands, whose threads stay
        yield daemon


@pytest.fixture
def at_origin(origin: Served) -> Iterator[transientcam.Camera]:
    with transientcam.Camera(origin.url, timeout_s=PATIENCE_S) as camera:
        yield camera
        camera.configure(**VIDEO)
        camera.start()


@pytest.fixture
def at_relay(relay: Served, at_origin: transientcam.Camera) -> Iterator[transientcam.Camera]:
    with transientcam.Camera(relay.url, timeout_s=PATIENCE_S) as camera:
        yield camera


def serving_relay(url: str, **settings: Any) -> Any:
    return serving(f"relay:{url}?timeout_s={PATIENCE_S:g}", **settings)


def test_a_frame_of_the_relay_is_the_origins_to_the_bit_with_its_way(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    with at_relay.stream("raw") as stream:
        relayed = stream.receive(timeout_s=PATIENCE_S)
    (hop,) = relayed.meta["hops"]
    assert hop["service_id"] == at_relay.info["service_id"]
    assert hop["latency_s"] > 0.0  # one machine, one clock
    kept = relay.service.history.newest(1e6)
    number = next(each.raw.number for each in kept if each.number == relayed.frame)
    theirs = at_origin.frame("raw", number=number)
    assert theirs.array.tobytes() == relayed.array.tobytes()
    assert theirs.extra["labels"] == relayed.extra["labels"]
    assert theirs.meta["device_time_s"] == relayed.meta["device_time_s"]
    assert theirs.meta["hops"] == []


def test_the_relay_states_the_origins_camera(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, origin: Served
) -> None:
    theirs, ours = at_origin.camera, at_relay.camera
    assert ours["sensor"] == theirs["sensor"]
    assert ours["capabilities"] == theirs["capabilities"] | {"phase_offsets": False}
    assert ours["intrinsics"] == theirs["intrinsics"] | {"source": "origin"}
    assert ours["origin"]["url"] == origin.url
    assert at_relay.info["path"][1:] == at_origin.info["path"]
    assert theirs["origin"] is None


def test_metrics_and_status_name_each_hop(at_relay: transientcam.Camera, relay: Served) -> None:
    before = at_relay.latest(wait_s=10.0)["hops"][0]["missed_frames"]
    text = httpx.get(f"{relay.url}/metrics").text
    after = at_relay.latest(wait_s=10.0)["hops"][0]["missed_frames"]
    assert 'transientcam_relay_hop_latency_seconds{hop="1"} ' in text
    missed = re.search(r'transientcam_relay_hop_missed_frames_total\{hop="1"\} (\S+)', text)
    assert missed is not None
    assert before <= float(missed[1]) <= after  # a laden machine misses some
    assert "transientcam_relay_origin_restarts_total 0.0" in text


def test_a_change_at_the_origin_arrives_in_order(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    with at_relay.stream("raw") as stream:
        before = stream.receive(timeout_s=PATIENCE_S)
        at_origin.configure(harmonics=2)
        after = read_until(stream, lambda frame: frame.meta["harmonics"] == 2)
        assert [each.kind for each in stream.notices if each.kind == "sequence-changed"]
    assert after.array.shape[0] == 8
    assert after.meta["sequence_id"] > before.meta["sequence_id"]
    assert at_relay.sequence["harmonics"] == 2


def test_a_change_at_the_relay_is_made_at_the_origin(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    assert at_relay.configure(harmonics=1)["harmonics"] == 1
    assert at_origin.sequence["harmonics"] == 1
    at_relay.stop()
    assert at_origin.acquisition["state"] == at_relay.acquisition["state"] == "stopped"
    at_relay.start()
    assert at_origin.acquisition["running"]
    at_relay.safe_off()
    assert not at_origin.acquisition["running"]


def test_start_and_stop_at_the_origin_are_followed(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    at_origin.stop()
    assert acquisition_until(at_relay, running=False)["state"] == "stopped"
    at_origin.start()
    acquisition_until(at_relay, running=True)
    at_relay.frame("raw", after=at_relay.latest()["frame"], wait_s=10.0)


def test_the_relays_lease_is_the_origins(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    with at_relay.lease("bench"):
        with pytest.raises(transientcam.ProblemError, match=r"bench \(through a relay\)"):
            at_origin.configure(harmonics=2)
        at_relay.configure(harmonics=2)
    at_origin.configure(harmonics=1)


def test_a_lease_at_the_origin_binds_the_relay(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera
) -> None:
    with at_origin.lease("alignment"):
        for change in (at_relay.stop, lambda: at_relay.configure(harmonics=2)):
            with pytest.raises(transientcam.ProblemError, match="alignment") as refused:
                change()
            assert refused.value.type == "/problems/lease-held"
        with pytest.raises(transientcam.ProblemError, match="alignment"), at_relay.lease("bench"):
            pass
        assert at_relay.acquisition["running"]
    with at_relay.lease("bench"):  # the one that was refused is not held here either
        pass


def test_a_calibration_is_not_measured_through_a_relay(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, origin: Served
) -> None:
    job = at_relay.calibrations.measure(frames=4)
    with pytest.raises(transientcam.ProblemError, match=origin.url) as refused:
        at_relay.wait_for(job["id"])
    assert refused.value.type == "/problems/camera-busy"


def test_a_recording_of_the_relay_has_the_origins_range_to_the_bit(
    at_origin: transientcam.Camera, at_relay: transientcam.Camera, relay: Served
) -> None:
    at_origin.simulate(diffuser=True)
    job = at_origin.calibrations.measure(frames=4, activate=True, harmonics=False)
    active = at_origin.wait_for(job["id"])["result"]["calibration"]
    at_origin.simulate(diffuser=False)
    with serving_relay(relay.url) as second, transientcam.Camera(second.url) as camera:
        wait_until(lambda: camera.calibrations.active()["calibration_id"] == active)  # through both
    with at_relay.stream("raw") as stream:
        read_until(stream, lambda frame: frame.meta["calibration_id"] == active)
    recorded = at_relay.record(frames=2)
    wait_until(lambda: at_relay.recording(recorded["id"])["state"] == "complete")
    path = next(relay.settings.recordings.directory.glob(f"*{recorded['id']}*"))
    with Recording(path) as recording:
        numbers = recording.series("device_frame")
    with transientcam.open(path) as opened:
        for index, number in enumerate(numbers):
            theirs = at_origin.frame("range", number=int(number))
            assert theirs.meta["calibration_id"] == active
            assert opened[index].range_m.tobytes() == theirs.array.tobytes()


@pytest.mark.parametrize(
    ("role", "may_light", "change", "light"),
    [
        (Role.VIEWER, True, "role-too-low", "role-too-low"),
        (Role.OPERATOR, False, None, "may-not-light"),
        (Role.OPERATOR, True, None, None),
    ],
)
def test_a_relay_lends_what_its_token_may_and_nothing_else(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    role: Role,
    may_light: bool,
    change: str | None,
    light: str | None,
) -> None:
    file = TokenFile(tmp_path / "tokens.json")
    _, token = file.create("relay", role, now=utc_now(), may_light=may_light)
    given = tmp_path / "token"
    given.write_text(token + "\n", encoding="utf-8")
    with serving(ORIGIN, sequence=VIDEO, require_token=True, tokens_file=file.path) as origin:
        with pytest.raises(CameraLost, match="token"):
            RelayCamera(Origin(origin.url, None, timeout_s=PATIENCE_S))
        monkeypatch.setenv(TOKEN_VARIABLE, "of another service")
        name = f"relay:{origin.url}?timeout_s={PATIENCE_S:g}&token_file={given}"
        with serving(name) as relay, transientcam.Camera(relay.url) as camera:
            assert camera.camera["origin"]["role"] == str(role)
            for wanted, refusal in (
                (lambda: camera.configure(harmonics=2), change),
                (camera.stop, change),
                (camera.safe_off, None),
                (camera.start, light),
            ):
                assert refused(wanted) == refusal
            assert origin.service.acquisition.status().running is (light is None)


def refused(wanted: Callable[[], Any]) -> str | None:
    """Return the origin's reason, None where it was done."""
    try:
        wanted()
    except transientcam.ProblemError as problem:
        return problem.type.removeprefix("/problems/")
    return None


def test_a_cut_connection_is_resumed_and_what_is_missing_is_counted(origin: Served) -> None:
    with (
        forwarding(origin.url) as network,
        serving_relay(network.url) as relay,
        transientcam.Camera(relay.url) as camera,
        camera.stream("raw", credits=None) as stream,
    ):
        stream.receive(timeout_s=PATIENCE_S)
        network.cut()
        while "camera-back" not in [each.kind for each in stream.notices]:
            stream.receive(timeout_s=PATIENCE_S)
        assert camera.camera["origin"]["reconnects"] >= 1
        held = [each.raw for each in relay.service.history.newest(1e6)]
    # a laden machine loses images between camera and origin, too
    there = {each.number: each.raw.lost_images for each in origin.service.history.newest(1e6)}
    assert held[0].lost_images == there[held[0].number]
    for before, after in pairwise(held):
        missed = after.number - before.number - 1
        assert after.lost_images == there[after.number] + missed * len(after.labels)
        assert after.hops[0].missed_frames == before.hops[0].missed_frames + missed


def test_after_a_restart_of_the_origin_frames_go_on(origin: Served) -> None:
    with forwarding(origin.url) as network, serving_relay(network.url) as relay:
        service = relay.service
        with transientcam.Camera(relay.url) as camera, camera.stream("raw") as stream:
            before = stream.receive(timeout_s=PATIENCE_S)
            number = service.history.latest.raw.number
            with serving(ORIGIN, sequence=VIDEO) as second:
                network.target = second.url
                network.cut()
                after = read_until(
                    stream, lambda frame: frame.meta["sequence_id"] > before.meta["sequence_id"]
                )
                assert after.frame > before.frame
                assert camera.camera["origin"]["restarts"] == 1
                assert service.history.latest.raw.number > number
                network.target = "http://127.0.0.1:1"  # nothing answers there
                network.cut()
            wait_until(lambda: camera.acquisition["state"] == "lost")


def test_a_loop_is_refused(origin: Served) -> None:
    with (
        forwarding(origin.url) as network,
        serving_relay(network.url) as first,
        serving_relay(first.url) as second,
        transientcam.Camera(first.url) as watching,
        transientcam.Camera(second.url) as camera,
    ):
        meta = camera.latest(wait_s=10.0)
        ids = [hop["service_id"] for hop in meta["hops"]]
        assert ids == [watching.info["service_id"], camera.info["service_id"]]
        network.target = second.url  # the first one now relays what relays it
        network.cut()
        wait_until(lambda: "loop" in (watching.acquisition["reason"] or ""))


def test_chains_and_ends_leave_the_origin_as_it_was(at_origin: transientcam.Camera) -> None:
    with (
        serving_relay(at_origin.url) as first,
        serving_relay(first.url) as second,
        transientcam.Camera(second.url) as camera,
    ):
        assert len(camera.latest(wait_s=10.0)["hops"]) == 2
        assert len(camera.info["path"]) == 3
    assert at_origin.acquisition["running"]


def test_what_a_relay_switched_on_goes_off_with_it(at_origin: transientcam.Camera) -> None:
    at_origin.stop()
    with serving_relay(at_origin.url) as relay, transientcam.Camera(relay.url) as camera:
        assert camera.acquisition["state"] == "stopped"
        camera.start()
        assert at_origin.acquisition["running"]
    assert not at_origin.acquisition["running"]
