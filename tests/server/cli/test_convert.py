import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from tests.server.recording.made import frame, record
from transientcam.cli import run


def test_convert_writes_what_the_suffix_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = record(tmp_path / "a.h5", 2)

    assert run(["convert", str(source), "-o", str(tmp_path / "a.npz")]) == 0
    with np.load(tmp_path / "a.npz") as archive:
        np.testing.assert_array_equal(archive["raw"][1], frame(1).images)
    assert run(["convert", str(source), "-o", str(tmp_path / "b.npz"), "--json"]) == 0
    document = {"file": str(tmp_path / "b.npz"), "frames": 2}
    assert json.loads(capsys.readouterr().out) == document
    assert run(["convert", str(source), "-o", str(tmp_path / "a.xyz")]) == 1
    assert ".nc, .npz, .zarr" in capsys.readouterr().err


def test_convert_takes_products_by_commas_and_names_an_assumed_lens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, output = record(tmp_path / "a.h5", 1), tmp_path / "a.mcap"
    words = ["--product", "range,pointcloud", "--product", "raw", "--schemas", "ros2"]

    assert run(["convert", str(source), "-o", str(output), *words]) == 0

    printed = " ".join(capsys.readouterr().err.split())
    assert "a.mcap: 1 frames" in printed
    assert "assume fx = 19.3 pixels" in printed
    with Reader(output) as reader:
        assert {"/range", "/depth", "/pointcloud", "/raw/image_000"} < set(reader.topics)
