"""`transientcam serve --check`: nothing is served, every finding is reported."""

import json
import os
import tomllib
from pathlib import Path
from typing import Any

import pytest

from tests.server.recording.made import record
from transientcam.cli import run
from transientcam_server.daemon import load_settings
from transientcam_server.daemon._configuration import ENVIRONMENT_PREFIX


@pytest.fixture(autouse=True)
def nothing_set(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in [name for name in os.environ if name.startswith(ENVIRONMENT_PREFIX)]:
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def checked(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    code = run(["serve", "--check", "--json", *arguments])
    return code, json.loads(capsys.readouterr().out)


def test_every_setting_is_reported_with_where_it_was_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "transientcam.toml").write_text("[stream]\nmax_clients = 5\n")
    monkeypatch.setenv("TRANSIENTCAM_WORKERS", "3")

    code, document = checked(capsys, "--port", "8123")

    assert (code, document["valid"]) == (0, True)
    settings = document["settings"]
    assert settings["port"] == {"value": 8123, "given": "--port"}
    assert settings["workers"] == {"value": 3, "given": "TRANSIENTCAM_WORKERS"}
    place = "transientcam.toml: stream.max_clients"
    assert settings["stream.max_clients"] == {"value": 5, "given": place}
    assert settings["camera"] == {"value": "sim:mirrors", "given": None}


def test_what_is_printed_is_a_file_that_sets_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["serve", "--check", "--port", "8123", "--camera", "sim:wall"]) == 0

    printed = capsys.readouterr().out
    assert 'camera = "sim:wall"  # --camera' in printed
    assert "# tls_key is not set" in printed
    file = tmp_path / "printed.toml"
    file.write_text(printed)
    assert tomllib.loads(printed)["stream"]["max_clients"] == 256
    assert load_settings({}, file=file, environment={}) == load_settings(
        {"port": 8123, "camera": "sim:wall"}, environment={}
    )


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ("sim:nowhere", "nowhere"),
        ("sim:wall?colour=on", "colour"),
        ("lidar", "no camera is called 'lidar'"),
        ("recording:absent.h5", "absent.h5"),
        ("sim:broken.toml", "broken.toml"),
    ],
)
def test_a_camera_that_cannot_be_opened_is_a_mistake_with_its_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], camera: str, words: str
) -> None:
    (tmp_path / "broken.toml").write_text("nonsense = 1\n")

    code, document = checked(capsys, "--camera", camera)

    assert (code, document["valid"]) == (1, False)
    (mistake,) = document["mistakes"]
    assert (mistake["place"], mistake["value"]) == ("--camera", camera)
    assert words in mistake["reason"]


@pytest.mark.parametrize("camera", ["usb", "usb:A-17", "sim:visitor?noise=off"])
def test_a_camera_is_not_opened(capsys: pytest.CaptureFixture[str], camera: str) -> None:
    assert checked(capsys, "--camera", camera)[0] == 0


def test_a_recording_that_can_be_replayed_is_usable(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert checked(capsys, "--camera", f"recording:{record(tmp_path / 'a.h5', 1)}")[0] == 0


def test_a_calibration_that_is_none_is_reported_beside_the_camera(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.npz").write_bytes(b"no zip")

    code, document = checked(capsys, "--camera", "lidar", "--calibration", "a.npz")

    assert code == 1
    assert [each["place"] for each in document["mistakes"]] == ["--camera", "--calibration"]


def test_without_json_each_mistake_is_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "transientcam.toml").write_text("prot = 1\nworkers = 0\n")

    assert run(["serve", "--check", "--port", "-5"]) == 1

    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert "did you mean port?" in " ".join(lines)
