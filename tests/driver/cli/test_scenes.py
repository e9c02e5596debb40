import json
from collections.abc import Callable

import pytest
import typer
from typer.testing import CliRunner

from transientcam_driver import LibusbMissing, list_scenes
from transientcam_driver.cli import scenes
from transientcam_driver.usb import UsbCamera


def run(*arguments: str, verb: Callable[..., None] = scenes.scenes) -> str:
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


def test_what_is_plugged_in_is_listed_with_the_name_that_opens_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(scenes, "list_cameras", lambda: (UsbCamera("/dev/x", "A-17", "lidar"),))

    assert scenes.plugged_in() == {
        "cameras": [
            {
                "node": "/dev/x",
                "serial": "A-17",
                "product": "lidar",
                "problem": None,
                "spec": "usb:A-17",
            }
        ],
        "problem": None,
        "simulated": [f"sim:{info.name}" for info in list_scenes()],
    }


def test_a_missing_libusb_is_listed_beside_the_simulated_cameras(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing() -> None:
        raise LibusbMissing

    monkeypatch.setattr(scenes, "list_cameras", missing)

    listed = scenes.plugged_in()

    assert (listed["cameras"], listed["simulated"][0]) == ([], f"sim:{list_scenes()[0].name}")
    assert "apt install" in listed["problem"]
