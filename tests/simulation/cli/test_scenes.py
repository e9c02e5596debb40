import json
from collections.abc import Callable

import typer
from typer.testing import CliRunner

from transientcam_driver import list_scenes
from transientcam_simulation.cli import scenes


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
