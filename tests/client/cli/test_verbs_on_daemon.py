"""capture and watch, against the daemon."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.serving import Served, serving
from transientcam import Camera, Notice, wire
from transientcam.cli import run
from transientcam.cli.statistics import Sample
from transientcam.cli.terminal import Terminal
from transientcam.cli.watch import Screen


@pytest.fixture
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon:
        yield daemon


def test_capture_saves_every_format(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for suffix in ("npy", "npz", "png", "msgpack", "json", "tiff", "csv"):
        path = tmp_path / f"range.{suffix}"

        assert run(["capture", served.url, "range", "-o", str(path)]) == 0

        assert capsys.readouterr().out == f"range: {path.stat().st_size} bytes in {path}\n"
    range_m = np.load(tmp_path / "range.npy")
    assert range_m.shape == (120, 163)
    with np.load(tmp_path / "range.npz") as parts:
        assert parts["array"].shape == (120, 163)
    with Image.open(tmp_path / "range.png") as image:
        assert image.size == (163, 120)
    with Image.open(tmp_path / "range.tiff") as image:
        assert (image.size, image.mode) == ((163, 120), "F")
    assert np.loadtxt(tmp_path / "range.csv", delimiter=",").shape == (120, 163)
    assert wire.parse_frame((tmp_path / "range.msgpack").read_bytes()).product == "range"
    assert len(json.loads((tmp_path / "range.json").read_text())["array"]) == 120


def test_raw_images_are_saved_with_what_makes_moments_of_them(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["capture", served.url, "raw", "-o", str(tmp_path / "raw.npz")]) == 0

    with np.load(tmp_path / "raw.npz") as parts:
        assert parts["weight"].shape == (4, len(parts["array"]))
        assert parts["gain"].shape == (4,)
        assert set(parts["kind"]) == {"modulated"}


def test_capture_takes_times_of_flight(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times, bins = tmp_path / "times.npz", tmp_path / "bins.npz"

    options = ["--time-s", "1.13e-8", "--time-s", "2e-8", "-o", str(times)]
    assert run(["capture", served.url, "transient", *options]) == 0
    assert run(["capture", served.url, "cumulative", "--bins", "5", "-o", str(bins), "--json"]) == 0

    with np.load(times) as parts:
        assert parts["time_s"].tolist() == [1.13e-8, 2e-8]
        assert parts["array"].shape == (2, 120, 163)
    report = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert report["shape"] == [5, 120, 163]
    assert (report["unit"], report["file"]) == ("DN", str(bins))
    assert report["meta"]["frame"] >= 1


def test_capture_takes_a_part_of_a_former_frame_or_of_a_recorded_one(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part, recorded = tmp_path / "part.npz", tmp_path / "recorded.tif"
    cut = ["--region", "40,30,64,48", "--decimation", "2"]
    with Camera(served.url) as camera:
        number = camera.latest(wait_s=10.0)["frame"]
        camera.latest(after=number, wait_s=10.0)
        recording = camera.record(history_s=10.0)["id"]
        camera.stop_recording(recording)

    former = ["capture", served.url, "range", "--number", str(number), *cut, "-o", str(part)]
    assert run(former) == 0
    old = ["capture", served.url, "range", "--recording", recording, "--number", "2"]
    assert run([*old, "-o", str(recorded)]) == 0

    with np.load(part) as parts:
        meta = json.loads(parts["meta"].item())
        assert parts["array"].shape == (24, 32)
    assert (meta["frame"], meta["region"], meta["decimation"]) == (number, [40, 30, 64, 48], 2)
    with Image.open(recorded) as image:
        assert image.size == (163, 120)
    cloud = tmp_path / "cloud.ply"
    assert run(["capture", served.url, "pointcloud", "-o", str(cloud)]) == 0
    assert cloud.read_bytes().startswith(b"ply\nformat binary_little_endian 1.0\n")
    capsys.readouterr()
    assert run(["capture", served.url, "range", "--region", "a,b", "-o", str(part)]) == 2
    assert "x,y,width,height" in " ".join(capsys.readouterr().err.split())


def test_capture_writes_to_standard_output(
    served: Served, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    assert run(["capture", served.url, "range", "--format", "msgpack", "-o", "-"]) == 0

    assert wire.parse_frame(capfdbinary.readouterr().out).product == "range"


def test_a_refusal_of_the_daemon_is_one_sentence(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["capture", served.url, "rang", "-o", str(tmp_path / "r.npy")]) == 1

    error = capsys.readouterr().err
    assert error.startswith(
        "transientcam: There is no product 'rang'; there are bounds, brightness, "
    )
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_is_one_sentence(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "nowhere" / "r.npy"

    assert run(["capture", served.url, "range", "-o", str(path)]) == 1

    assert capsys.readouterr().err == f"transientcam: No such file or directory: {path}\n"


def test_a_suffix_that_is_no_format_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["capture", "http://127.0.0.1:1", "range", "-o", str(tmp_path / "r.bmp")]) == 2
    assert "one of npy" in " ".join(capsys.readouterr().err.split())


def test_watch_prints_json_for_programs(served: Served, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["watch", served.url, "range", "coefficients", "--json", "--count", "4"]

    assert run(arguments) == 0

    lines: list[dict[str, Any]] = list(map(json.loads, capsys.readouterr().out.splitlines()))
    frames = [line for line in lines if line["type"] == "frame"]
    assert [line["product"] for line in frames] == ["range", "coefficients"] * 3 + ["range"]
    assert frames[0]["unit"] == "m"
    assert 0.0 < frames[0]["median"] < 6.6
    assert frames[-1]["rate_hz"] > 0.0
    assert 0.0 <= frames[-1]["latency_s"] < 60.0


def test_watch_prints_a_line_a_frame_where_there_is_no_terminal(
    served: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["watch", served.url, "--count", "2"]) == 0

    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("range")]
    assert len(lines) == 2
    assert " Hz " in lines[1]
    assert " m" in lines[1]


def test_watch_without_a_daemon_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["watch", "http://127.0.0.1:1"]) == 1

    assert capsys.readouterr().err == (
        "transientcam: No camera answers at ws://127.0.0.1:1/api/v1/stream: Connection refused\n"
    )


def test_a_terminal_shows_one_line_a_product_and_every_notice() -> None:
    console = Terminal(force_terminal=True, width=100, record=True)
    screen = Screen(console)
    sample = Sample(
        frame=1,
        product="range",
        unit="m",
        rate_hz=18.6,
        latency_s=0.0123,
        median=1.7284,
        dropped=2,
        lost_images=3,
    )

    with screen.shown():
        screen.sample(sample)
        screen.notice(Notice("camera-lost", {"reason": "unplugged"}))
        screen.sample(sample)

    text = console.export_text()
    assert "camera-lost  reason unplugged" in text
    assert "18.6 Hz" in text
    assert "12.3 ms  dropped 2  lost images 3  median 1.728 m" in text
