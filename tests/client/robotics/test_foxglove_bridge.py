"""A daemon, the bridge, and a bare viewer."""

import json
import queue
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

from tests.client.robotics.reporting import WAIT_S, said
from tests.client.robotics.viewer import viewing
from tests.serving import Served, serving
from transientcam import Camera, Notice, ParameterError
from transientcam.cli import foxglove as verb
from transientcam.robotics import FoxgloveBridge, Report

SPEC = "sim:mirrors?noise=off"
SEQUENCE: dict[str, Any] = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving(SPEC) as daemon, Camera(daemon.url, timeout_s=60.0) as camera:
        daemon.start_all_workers()  # later they would look like threads that a test left behind
        camera.sequence = SEQUENCE
        with camera.stream("range") as stream:
            stream.receive(timeout_s=WAIT_S)
        yield daemon


@pytest.fixture
def silent() -> Iterator[Camera]:
    """A camera that says its lens, and nothing else."""
    lens = {"fx": 3.0, "fy": 4.0, "cx": 1.0, "cy": 2.0, "width": 5, "height": 6, "source": "scene"}
    answer = httpx.Response(200, json={"intrinsics": lens, "products": []})
    with Camera("http://silent", transport=httpx.MockTransport(lambda request: answer)) as camera:
        yield camera


@contextmanager
def bridged(url: str, **options: Any) -> Iterator[tuple[FoxgloveBridge, queue.Queue[Report]]]:
    reports: queue.Queue[Report] = queue.Queue()
    with (
        Camera(url, timeout_s=60.0) as camera,
        running(camera, on_report=reports.put, **options) as bridge,
    ):
        yield bridge, reports


@contextmanager
def running(camera: Camera, **options: Any) -> Iterator[FoxgloveBridge]:
    with FoxgloveBridge(camera, port=0, **options) as bridge:
        thread = threading.Thread(target=bridge.run, name="bridge")
        thread.start()
        try:
            yield bridge
        finally:
            bridge.close()
            thread.join()


def pixels(message: Any) -> NDArray[Any]:
    assert message.encoding == "32FC1"
    return np.frombuffer(message.data, "<f4").reshape(message.height, message.step // 4)


def test_a_viewer_sees_the_values_of_the_camera(served: Served) -> None:
    topics = ("/range", "/depth", "/depth_rect", "/pointcloud", "/camera_info", "/tf_static")
    with bridged(served.url) as (bridge, _), viewing(bridge.url) as viewer:
        assert set(viewer.channels) == {*topics, "/direct", "/indirect", "/brightness"}
        viewer.subscribe(*topics)
        seen = viewer.frame(*topics)

    with Camera(served.url, timeout_s=60.0) as camera:
        wanted = camera.frame("range").array
        direct = camera.frame("direct").array
        cloud = camera.frame("pointcloud").array
        lens = camera.camera["intrinsics"]
    # without noise one frame is as the other
    np.testing.assert_allclose(pixels(seen["/range"]), wanted, rtol=1e-5)
    np.testing.assert_allclose(pixels(seen["/depth"]), cloud[2], rtol=1e-5)
    assert np.isfinite(wanted).mean() > 0.5
    points = np.frombuffer(seen["/pointcloud"].data, "<f4").reshape(-1, 4)
    there = np.isfinite(cloud[2])
    np.testing.assert_allclose(points[:, :3], cloud[:, there].T, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(points[:, 3], direct[there], rtol=1e-4)
    found = seen["/camera_info"]
    assert (found.K[0], found.K[2], found.K[4], found.K[5]) == (
        lens["fx"],
        lens["cx"],
        lens["fy"],
        lens["cy"],
    )
    (transform,) = seen["/tf_static"].transforms
    assert transform.child_frame_id == seen["/range"].frame_id == "camera_optical_frame"


def test_only_what_is_looked_at_is_asked_of_the_camera(served: Served) -> None:
    with bridged(served.url) as (bridge, reports), viewing(bridge.url) as viewer:
        viewer.subscribe("/range")
        assert said(reports, "streaming").text == "streaming range"
        viewer.message("/range")
        viewer.subscribe("/brightness")
        viewer.message("/brightness")
        viewer.unsubscribe("/range", "/brightness")
        said(reports, "no viewer is subscribed")
        # of what the viewer no longer looks at, what was under way may still come
        viewer.subscribe("/indirect")
        assert said(reports, "streaming").text == "streaming indirect"
        assert viewer.message("/indirect").decoded.height == 120


def test_a_viewer_that_leaves_without_a_word_is_no_longer_served(served: Served) -> None:
    with bridged(served.url) as (bridge, reports):
        with viewing(bridge.url) as viewer:
            viewer.subscribe("/range")
            viewer.message("/range")
        said(reports, "no viewer is subscribed")


def test_viewers_see_the_parameters_and_cannot_set_them(served: Served) -> None:
    with bridged(served.url) as (bridge, _), viewing(bridge.url) as viewer:
        values = viewer.parameters("sequence.harmonics", "sequence.exposure_s", "sequence.zeroth")
        assert values == {
            "sequence.harmonics": 3,
            "sequence.exposure_s": 0.0005,
            "sequence.zeroth": "estimated",
        }
        assert viewer.parameters().keys() > {*values, "reconstruction.bias", "acquisition.running"}

        answer = viewer.set_parameters(sequence__harmonics=4, acquisition__running=False)

        assert (answer["sequence.harmonics"], answer["acquisition.running"]) == (3, True)
        assert "--control" in viewer.status("sequence.harmonics is 4")["message"]
    with Camera(served.url, timeout_s=60.0) as camera:
        assert camera.sequence["harmonics"] == 3


def test_viewers_that_were_given_control_set_parameters_and_see_those_of_others(
    served: Served,
) -> None:
    with (
        Camera(served.url, timeout_s=60.0) as other,
        bridged(served.url, control=True) as (bridge, _),
        viewing(bridge.url) as viewer,
    ):
        before = other.sequence, other.reconstruction
        answer = viewer.set_parameters(
            sequence__exposure_s=0.0004,
            sequence__sub_phases__n=4.0,
            reconstruction__return_threshold=0.2,
        )
        assert answer["sequence.exposure_s"] == other.sequence["exposure_s"] == 0.0004
        assert other.sequence["sub_phases"]["n"] == 4
        assert other.reconstruction["return_threshold"] == 0.2
        assert other.sequence["zeroth"] == before[0]["zeroth"]

        viewer.set_parameters(sequence__harmonics=99)
        assert "harmonics" in viewer.status("99")["message"]
        viewer.set_parameters(history__seconds=1.0)
        assert "read-only" in viewer.status("history.seconds")["message"]
        viewer.set_parameters(nonsense=1)
        viewer.status("parameter is 'nonsense'")
        with other.lease("the one in control"):
            viewer.set_parameters(sequence__exposure_s=0.0006)
            assert "the one in control" in viewer.status("control")["message"]
            assert other.sequence["exposure_s"] == 0.0004

        viewer.follow_parameters("sequence.exposure_s")
        viewer.subscribe("/brightness")
        viewer.message("/brightness")
        other.sequence, other.reconstruction = before
        while viewer.update().get("sequence.exposure_s") != 0.0005:
            pass


def test_a_capture_answers_with_a_frame_that_was_not_there_before(served: Served) -> None:
    with (
        Camera(served.url, timeout_s=60.0) as camera,
        bridged(served.url) as (bridge, _),
        bridged(served.url, control_light=True) as (in_control, _),
        viewing(bridge.url) as viewer,
        viewing(in_control.url) as operator,
    ):
        newest = camera.frames["last"]
        found = viewer.call("/capture")
        assert found["frame"] > newest
        assert (found["harmonics"], found["width"]) == (3, 163)

        camera.stop()
        newest = camera.frames["last"]
        assert "--control-light was not given" in viewer.call("/capture")["message"]
        assert operator.call("/capture")["frame"] > newest
        assert camera.acquisition["running"] is False
        camera.start()
        camera.latest(after=camera.frames["last"], wait_s=10)


def test_lens_and_pose_can_be_looked_at_alone(silent: Camera) -> None:
    reports: list[Report] = []
    with (
        running(silent, on_report=reports.append, now_ns=lambda: 5 * 10**9) as bridge,
        viewing(bridge.url) as viewer,
    ):
        viewer.subscribe("/tf_static", "/camera_info")
        pose, lens = viewer.message("/tf_static"), viewer.message("/camera_info")
    assert pose.time_ns == pose.decoded.transforms[0].timestamp.ToNanoseconds() == 5 * 10**9
    assert list(lens.decoded.K) == [3.0, 0.0, 1.0, 0.0, 4.0, 2.0, 0.0, 0.0, 1.0]
    assert reports == []


def test_viewers_are_shown_that_the_camera_is_gone_and_see_it_again() -> None:
    with ExitStack() as stays:
        with serving(SPEC) as first:
            port = int(first.url.rpartition(":")[2])
            bridge, _ = stays.enter_context(bridged(first.url))
            viewer = stays.enter_context(viewing(bridge.url))
            viewer.subscribe("/brightness")
            viewer.message("/brightness")
        assert viewer.status("connection to the camera lost")["level"] == 2
        with serving(SPEC, port=port):
            assert viewer.status("connected to the camera again")["id"] == "connection"
            assert viewer.message("/brightness").decoded.width == 163


def test_dropped_frames_are_counted_for_viewers_every_few_seconds(silent: Camera) -> None:
    times_ns = iter([10 * 10**9, 12 * 10**9, 16 * 10**9])
    reports: list[Report] = []
    with (
        FoxgloveBridge(
            silent, port=0, on_report=reports.append, now_ns=lambda: next(times_ns)
        ) as bridge,
        viewing(bridge.url) as viewer,
    ):
        for total in (1, 2, 3):
            bridge._source.noticed(Notice("dropped", {"channel": 0, "count": 1, "total": total}))
        assert viewer.status("1 frames dropped")["level"] == 1
        assert viewer.status("3 frames dropped")["id"] == "dropped"
    assert [report.text.split()[0] for report in reports] == ["1", "3"]


def test_what_is_reported_while_it_stops_is_let_go(silent: Camera) -> None:
    reporting, ended = threading.Event(), threading.Event()
    failed: list[RuntimeError] = []

    def report() -> None:
        while not ended.is_set():
            try:
                bridge._source.report(Report("info", "connection", "still here"))
            except RuntimeError as error:
                failed.append(error)
            reporting.set()

    for _ in range(5):  # each hit the server as it stopped
        with FoxgloveBridge(silent, port=0) as bridge:
            thread = threading.Thread(target=report, name="reporting")
            thread.start()
            reporting.wait()
        ended.set()
        thread.join()
        reporting.clear()
        ended.clear()
    assert failed == []


@pytest.mark.parametrize("product", ["raw", "transient", "moments", "nothing"])
def test_what_is_no_image_and_no_points_is_refused(silent: Camera, product: str) -> None:
    with pytest.raises(ParameterError, match="pointcloud"):
        FoxgloveBridge(silent, products=["range", product], port=0)


def test_a_taken_port_is_named(silent: Camera) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=f"127.0.0.1:{port}"):
            FoxgloveBridge(silent, port=port)


def test_the_verb_says_where_to_connect(
    served: Served, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(bridge: FoxgloveBridge) -> None:
        with viewing(bridge.url) as viewer:
            assert set(viewer.channels) == {"/flags", "/camera_info", "/tf_static"}

    monkeypatch.setattr(FoxgloveBridge, "run", run)
    verb.foxglove(served.url, ["flags"], host="127.0.0.1", port=0, max_rate_hz=5.0, as_json=True)

    document = json.loads(capsys.readouterr().out)
    assert document["type"] == "serving"
    assert document["url"].startswith("ws://127.0.0.1:")
