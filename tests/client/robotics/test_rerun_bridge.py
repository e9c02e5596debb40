"""A daemon, the bridge, and what it wrote, read back by Rerun's own reader."""

import queue
import subprocess
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import typer
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from tests.client.robotics.reporting import WAIT_S, said
from tests.serving import Served, serving
from transientcam import Camera, ParameterError, transient
from transientcam.cli import rerun as verb
from transientcam.robotics import Report, RerunBridge
from transientcam.robotics._rerun_bridge import FLUSH_S, FRAMES

SEQUENCE: dict[str, Any] = {"harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon, Camera(daemon.url, timeout_s=60.0) as camera:
        daemon.start_all_workers()  # later they would look like threads that a test left behind
        camera.sequence = SEQUENCE
        with camera.stream("range") as stream:
            stream.receive()
        yield daemon


class Logged:
    """What a file of Rerun has, by entity and component."""

    def __init__(self, path: Path) -> None:
        self._batches: dict[str, list[Any]] = {}
        for chunk in RrdReader(path).stream():
            self._batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())

    @property
    def entities(self) -> set[str]:
        """Those that are not Rerun's own."""
        return {each for each in self._batches if not each.startswith("/__")}

    def column(self, entity: str, component: str) -> list[Any]:
        """A component at each time that has it."""
        return [
            row
            for batch in self._batches[entity]
            if component in batch.schema.names
            for row in batch.column(batch.schema.names.index(component))
        ]

    def image(self, entity: str, kind: str) -> NDArray[np.float32]:
        """The last image of float32."""
        (form,) = self.column(entity, f"{kind}:format")[-1].as_py()
        pixels = self.column(entity, f"{kind}:buffer")[-1].values.flatten().to_numpy()
        return np.frombuffer(pixels, "<f4").reshape(form["height"], form["width"])

    def numbers(self, entity: str, component: str) -> NDArray[np.float64]:
        """A component of numbers, the last one, flat."""
        found = self.column(entity, component)[-1].as_py()
        return np.array(found, dtype=np.float64).ravel()

    def texts(self) -> list[str]:
        """The reports."""
        return [each.as_py()[0] for each in self.column("/reports", "TextLog:text")]


def test_a_file_has_the_values_of_the_camera(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.rrd"
    shown = ["brightness", "range", "direct", "pointcloud", "transient"]
    # brightness is counted: the second one comes after every product of the first frame
    verb.rerun(served.url, shown, save=path, count=2, bins=16, as_json=True)

    # a laden machine drops frames and says so; nothing worse happens
    assert '"level": "error"' not in capsys.readouterr().out
    with Camera(served.url, timeout_s=60.0) as camera:
        # without noise one frame is as the other
        cloud, direct = camera.frame("pointcloud").array, camera.frame("direct").array
        coefficients, range_ = camera.frame("coefficients"), camera.frame("range")
        lens = camera.camera["intrinsics"]
    logged = Logged(path)
    assert logged.entities - {"/reports"} == {
        *("/", "/camera", "/camera/image", "/camera/image/depth", "/camera/points"),
        *("/images/brightness", "/images/range", "/images/direct"),
        *("/transient", "/deviation/predicted_m"),
    }
    depth = logged.image("/camera/image/depth", "DepthImage")
    np.testing.assert_allclose(depth, cloud[2], rtol=1e-5)
    found = logged.image("/images/range", "Image")
    np.testing.assert_allclose(found, range_.array, rtol=1e-5)
    assert np.isfinite(found).mean() > 0.5
    assert logged.numbers("/camera/image/depth", "DepthImage:meter") == [1.0]
    matrix = logged.numbers("/camera/image", "Pinhole:image_from_camera").reshape(3, 3).T
    expected = [[lens["fx"], 0.0, lens["cx"]], [0.0, lens["fy"], lens["cy"]], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(matrix, expected, rtol=1e-6)
    points = logged.numbers("/camera/points", "Points3D:positions").reshape(-1, 3)
    there = np.isfinite(cloud[2])
    np.testing.assert_allclose(points, cloud[:, there].T, rtol=1e-5, atol=1e-6)
    # colours follow the direct light: the brightest is the palette's last, the darkest is not
    colours = logged.column("/camera/points", "Points3D:colors")[-1].as_py()
    assert colours[int(np.argmax(direct[there]))] == 0xFFFADCFF
    assert colours[int(np.argmin(direct[there]))] < 0x60000000
    (tensor,) = logged.column("/transient", "Tensor:data")[-1].as_py()
    time_s = np.arange(16) / (16 * 23e6)
    np.testing.assert_allclose(logged.numbers("/transient", "time_s"), time_s)
    assert (tensor["shape"], tensor["names"]) == ([16, 120, 163], ["time", "y", "x"])
    light = transient(coefficients.array, time_s, base_frequency_hz=23e6)
    np.testing.assert_allclose(
        np.reshape(tensor["buffer"], tensor["shape"]), light, rtol=1e-3, atol=1e-3 * light.max()
    )
    predicted = range_.meta["predicted_range_std_m"]
    assert predicted is not None
    np.testing.assert_allclose(
        logged.numbers("/deviation/predicted_m", "Scalars:scalars"), predicted["median"], rtol=1e-4
    )


def test_measured_scatter_follows_after_some_frames(served: Served, tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    verb.rerun(served.url, ["range"], save=path, count=FRAMES, max_rate_hz=100.0)

    assert abs(Logged(path).numbers("/deviation/measured_m", "Scalars:scalars")) < 1e-6


class Stalling(rr.RecordingStream):
    """A recording whose viewer takes nothing the first times that it is asked.

    It is asked when a frame came.
    """

    def __init__(self, path: Path, *, refusals: int = 0) -> None:
        super().__init__("transientcam")
        self.set_sinks(rr.FileSink(path))
        self.asked = threading.Event()
        self._refusals = refusals

    def flush(self, *, timeout_sec: float = 1e38) -> None:
        if timeout_sec == FLUSH_S:
            self.asked.set()
            if self._refusals:
                self._refusals -= 1
                raise RuntimeError("no viewer")
        super().flush(timeout_sec=timeout_sec)


def test_frames_that_nothing_takes_are_counted_not_kept(served: Served, tmp_path: Path) -> None:
    reports: list[Report] = []
    recording = Stalling(tmp_path / "a.rrd", refusals=2)
    with (
        Camera(served.url, timeout_s=60.0) as camera,
        RerunBridge(camera, recording, products=["brightness"], on_report=reports.append) as bridge,
    ):
        bridge.run(4)
    recording.disconnect()

    assert [each.text for each in reports if each.about == "connection"] == [
        "frames are not taken: no viewer",
        "frames are taken again; 2 were not sent",
    ]
    logged = Logged(tmp_path / "a.rrd")
    assert "frames are taken again; 2 were not sent" in logged.texts()
    assert "frames are not taken: no viewer" not in logged.texts()
    assert len(logged.column("/images/brightness", "Image:buffer")) == 2


def test_a_camera_that_restarts_is_followed(tmp_path: Path) -> None:
    reports: queue.Queue[Report] = queue.Queue()
    path = tmp_path / "a.rrd"
    recording = Stalling(path)
    with ExitStack() as stays:
        with serving("sim:wall?noise=off") as first:
            port = int(first.url.rpartition(":")[2])
            camera = stays.enter_context(Camera(first.url, timeout_s=60.0))
            bridge = RerunBridge(camera, recording, products=["brightness"], on_report=reports.put)
            thread = threading.Thread(target=bridge.run, name="bridge")
            thread.start()
            stays.callback(thread.join)
            stays.callback(bridge.close)
            assert recording.asked.wait(WAIT_S)
        said(reports, "connection to the camera lost")
        with serving("sim:wall?noise=off", port=port):
            said(reports, "connected to the camera again")
    recording.disconnect()

    texts = Logged(path).texts()
    assert texts.index("connected to the camera again") > 0


@pytest.mark.parametrize("product", ["raw", "moments", "nothing"])
def test_what_cannot_be_shown_is_refused(served: Served, tmp_path: Path, product: str) -> None:
    with pytest.raises(ParameterError, match=r"pointcloud, .*transient"):
        verb.rerun(served.url, ["range", product], save=tmp_path / "a.rrd")


def test_a_file_that_cannot_be_written_and_an_address_of_none_are_named(
    served: Served, tmp_path: Path
) -> None:
    with pytest.raises(OSError, match="nowhere"):
        verb.rerun(served.url, save=tmp_path / "nowhere" / "a.rrd")
    with pytest.raises(OSError, match="invalid endpoint"):
        verb.rerun(served.url, connect="nonsense")
    with pytest.raises(typer.BadParameter, match="rrd"):
        verb.rerun(served.url, save=tmp_path / "a.mcap")


def test_a_viewer_that_is_started_is_reached_from_this_machine_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[list[str]] = []
    monkeypatch.setattr(subprocess, "Popen", lambda command, **_: started.append(command))

    verb._start_viewer()

    (command,) = started
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    monkeypatch.undo()
    # the viewer knows the options: it would refuse others
    known = subprocess.run([*command, "--version"], capture_output=True, check=False)
    assert b"error" not in known.stderr + known.stdout
    unknown = subprocess.run([*command, "--bound", "--version"], capture_output=True, check=False)
    assert b"error" in unknown.stderr


def test_with_a_token_a_viewer_is_started_only_where_that_is_said() -> None:
    with pytest.raises(typer.BadParameter, match="--spawn"):
        verb.rerun("http://127.0.0.1:9", token="t0ken")
