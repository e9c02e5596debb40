import json
from collections.abc import Callable

import pytest
import typer
from typer.testing import CliRunner

from transientcam_driver import LibusbMissing, commands, list_scenes
from transientcam_driver.usb import UsbCamera

FREE = UsbCamera("/dev/bus/usb/001/004", "A-17", "AMCW lidar")
FORBIDDEN = UsbCamera("/dev/bus/usb/001/005", problem="no permission to open it")


def run(*arguments: str, verb: Callable[..., None] = commands.scenes) -> str:
    app = typer.Typer()
    app.command()(verb)
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    return result.output


def test_scenes_are_listed_by_the_name_that_opens_them() -> None:
    words = " ".join(run().split())

    assert all(f"sim:{info.name} {info.description}" in words for info in list_scenes())


def test_scenes_are_printed_as_json() -> None:
    listed = json.loads(run("--json"))

    assert [entry["name"] for entry in listed] == [info.name for info in list_scenes()]
    assert {"corner", "mirrors", "visitor"} <= {entry["name"] for entry in listed}
    assert all(entry["description"] and entry["path"].endswith(".toml") for entry in listed)


def plug(monkeypatch: pytest.MonkeyPatch, *cameras: UsbCamera) -> None:
    monkeypatch.setattr(commands, "list_cameras", lambda: cameras)


def test_cameras_are_listed_by_the_name_that_opens_them(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, FREE, FORBIDDEN)

    output = run(verb=commands.devices)

    words = " ".join(output.split())
    assert "usb:A-17 A-17 AMCW lidar /dev/bus/usb/001/004" in words
    assert "/dev/bus/usb/001/005: no permission to open it" in words
    assert "sim:mirrors" in words


def test_cameras_are_printed_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, FREE, FORBIDDEN)

    listed = json.loads(run("--json", verb=commands.devices))

    assert [camera["spec"] for camera in listed["cameras"]] == ["usb:A-17", "usb"]
    assert listed["cameras"][1]["problem"] == "no permission to open it"
    assert listed["problem"] is None
    assert "sim:mirrors" in listed["simulated"]


def test_an_empty_bus_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch)

    assert "No camera is plugged in." in run(verb=commands.devices)


def test_a_missing_libusb_is_told_beside_the_simulated_cameras(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing() -> None:
        raise LibusbMissing

    monkeypatch.setattr(commands, "list_cameras", missing)

    assert "libusb-1.0 was not found" in run(verb=commands.devices)
    listed = json.loads(run("--json", verb=commands.devices))
    assert "apt install" in listed["problem"]
