"""The examples run, each as a user would run it."""

import io
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.serving import Served, serving
from transientcam import wire

_EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture
def served() -> Iterator[Served]:
    with serving("sim:mirrors?noise=off") as daemon:
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

    assert files == {"range_map.py", "transient_video.py", "curl.sh"}


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


def test_curl(served: Served, tmp_path: Path) -> None:
    printed = _run("sh", _EXAMPLES / "curl.sh", served.url, tmp_path)

    assert '"type":"/problems/invalid-sequence"' in printed
    assert np.load(tmp_path / "range.npy").shape == (120, 163)
    assert np.load(tmp_path / "transient.npy").shape == (2, 120, 163)
    assert wire.parse_frame((tmp_path / "range.msgpack").read_bytes()).product == "range"
    with Image.open(io.BytesIO((tmp_path / "range.png").read_bytes())) as image:
        assert image.size == (163, 120)
