"""The examples run, each as a user would run it."""

import io
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import httpx
import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData

import transientcam_moments as tm
from tests.conftest import ROOT
from tests.programs import needs_octave
from tests.serving import Served, serving
from transientcam import wire

_EXAMPLES = ROOT / "examples"
_MSGPACK = ROOT / "client" / "dashboard" / "node_modules" / "@msgpack"

needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not installed")


# of all examples: none relies on what another one has set
@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon:
        daemon.start_all_workers()  # later they would look like threads that a test left behind
        yield daemon


def _run(*arguments: object) -> str:
    done = subprocess.run(
        [str(each) for each in arguments], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_every_example_is_run_here() -> None:
    files = {path.name for path in _EXAMPLES.iterdir() if path.is_file()}

    assert files == {
        *("range_map.py", "transient_video.py", "curl.sh", "frame.mjs", "stream.mjs"),
        *("transientcam_frame.m", "make_measurement.py", "measurement.npz", "open3d_cloud.py"),
    }


def test_range_map(served: Served) -> None:
    printed = _run(sys.executable, _EXAMPLES / "range_map.py", served.url).splitlines()

    assert printed[0].endswith("163 x 120 pixels")
    assert "the camera sees 6.52 m without ambiguity" in printed[1]
    assert " m, median " in printed[2]
    assert [len(line) for line in printed[3:]] == [60] * 24


def test_transient_video(served: Served, tmp_path: Path) -> None:
    for name in ("film.npy", "film.gif"):
        path = tmp_path / name
        printed = _run(sys.executable, _EXAMPLES / "transient_video.py", served.url, path)

        assert printed.count("frame ") == 5
        assert printed.splitlines()[-1] == f"wrote {path}: 120 instants of 163 x 120 pixels"
    film = np.load(tmp_path / "film.npy")
    assert film.shape == (120, 120, 163)
    assert np.nanmax(film) > 0.0
    with Image.open(tmp_path / "film.gif") as image:
        assert image.size == (163, 120)


def test_a_measurement_is_made_of_a_frame(served: Served, tmp_path: Path) -> None:
    path = tmp_path / "measurement.npz"
    printed = _run(sys.executable, _EXAMPLES / "make_measurement.py", served.url, path)

    made = np.load(path)
    assert printed.startswith(f"wrote {path}: moments (")
    assert made["moments"].shape[1:] == made["range_m"].shape == (60, 82)
    found = tm.range_m(
        tm.separate(tm.pisarenko(made["moments"])).phase_rad, made["base_frequency_hz"]
    )
    assert np.nanmedian(abs(found - made["range_m"])) < 0.02


def test_the_sample_measurement_gives_its_true_range() -> None:
    sample = np.load(_EXAMPLES / "measurement.npz")

    result = tm.reconstruct(sample["moments"], tm.Settings(float(sample["base_frequency_hz"])))
    error_m = result.range_m - sample["range_m"]
    assert np.isfinite(error_m).mean() > 0.99
    assert np.median(abs(error_m)) < 0.03
    assert (_EXAMPLES / "measurement.npz").stat().st_size < 250_000


def test_curl(served: Served, tmp_path: Path) -> None:
    printed = _run("sh", _EXAMPLES / "curl.sh", served.url, tmp_path)

    assert '"type":"/problems/invalid-sequence"' in printed
    assert np.load(tmp_path / "range.npy").shape == (120, 163)
    assert np.load(tmp_path / "transient.npy").shape == (2, 120, 163)
    assert wire.parse_frame((tmp_path / "range.msgpack").read_bytes()).product == "range"
    with Image.open(io.BytesIO((tmp_path / "range.png").read_bytes())) as image:
        assert image.size == (163, 120)


@needs_node
def test_frame_in_javascript_needs_nothing_but_node(served: Served, tmp_path: Path) -> None:
    example = shutil.copy(_EXAMPLES / "frame.mjs", tmp_path)  # where no package is

    lines = _run("node", example, served.url).splitlines()

    assert lines[0].endswith("163 x 120 pixels")
    assert lines[1] == "12 images a frame at 18.6 Hz"
    assert "range 120 x 163" in lines[2]
    assert lines[3].startswith("pixel (80, 60): meta, x, y, range_m")
    assert "harmonics = 99" in lines[4]


@needs_node
@pytest.mark.skipif(not _MSGPACK.is_dir(), reason="npm ci was not run in client/dashboard")
def test_stream_in_javascript(served: Served, tmp_path: Path) -> None:
    example = shutil.copy(_EXAMPLES / "stream.mjs", tmp_path)
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules" / "@msgpack").symlink_to(_MSGPACK)

    for product, unit in (("range", "m"), ("flags", "1")):
        printed = _run("node", *_websocket_flag(), example, served.url, product, 3)

        assert f"transientcam: {product} of 120 x 163 in {unit}" in printed
        numbers = [
            int(each) for each in re.findall(r"^frame (\d+): mean \d", printed, re.MULTILINE)
        ]
        assert len(numbers) == 3
        assert numbers == sorted(set(numbers))
        assert printed.splitlines()[-1].startswith("closed (1000)")


def _websocket_flag() -> list[str]:
    """Return what Node 20 needs to have WebSocket; Node 22 has it."""
    has = subprocess.run(["node", "-p", "typeof WebSocket"], capture_output=True, text=True)
    return [] if has.stdout.strip() == "function" else ["--experimental-websocket"]


@pytest.mark.skipif(find_spec("open3d") is None, reason="Open3D is not installed")
def test_open3d_takes_points_and_reads_the_services_file(served: Served, tmp_path: Path) -> None:
    path, ours = tmp_path / "cloud.ply", tmp_path / "pointcloud.ply"
    printed = _run(sys.executable, _EXAMPLES / "open3d_cloud.py", served.url, path)
    with httpx.Client(base_url=served.url, timeout=60.0) as http:
        ours.write_bytes(http.get("/api/v1/frames/latest/pointcloud.ply").content)
    script = "import open3d, sys; print(len(open3d.io.read_point_cloud(sys.argv[1]).points))"
    counted = int(_run(sys.executable, "-c", script, ours))

    vertices = PlyData.read(path)["vertex"]
    assert f"{len(vertices)} of {120 * 163} points" in printed
    assert abs(len(vertices) - counted) < 0.01 * counted
    normals = np.stack([vertices[name] for name in ("nx", "ny", "nz")])
    points = np.stack([vertices[name] for name in "xyz"])
    assert np.median(np.linalg.norm(normals, axis=0)) == pytest.approx(1.0, abs=1e-3)
    assert ((normals * points).sum(axis=0) <= 1e-6).mean() > 0.99  # they look at the camera


@needs_octave
def test_transientcam_frame_in_octave(served: Served) -> None:
    program = f"addpath('{_EXAMPLES}'); transientcam_frame('{served.url}')"
    done = subprocess.run(
        ["octave-cli", "--quiet", "--norc", "--eval", program],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={name: value for name, value in os.environ.items() if name != "TRANSIENTCAM_TOKEN"},
    )

    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[:2] == ["AMCW lidar (simulated), 163 x 120 pixels", "12 images a frame at 18.6 Hz"]
    with httpx.Client(base_url=served.url, timeout=60.0) as http:
        answer = http.get("/api/v1/frames/latest/range.npy")
    range_m = np.load(io.BytesIO(answer.content))
    reported = re.search(r"range 120 x 163, ([\d.]+) to ([\d.]+) m, median ([\d.]+) m", lines[2])
    assert reported is not None
    expected = np.nanmin(range_m), np.nanmax(range_m), np.nanmedian(range_m)
    np.testing.assert_allclose([float(each) for each in reported.groups()], expected, atol=2e-3)
    assert lines[3].startswith("transient 2 x 120 x 163, brightest ")
    pixel_m = float(lines[4].split()[3])
    assert pixel_m == pytest.approx(range_m[60, 80], abs=2e-3)
