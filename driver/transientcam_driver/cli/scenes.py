"""The verb ``scenes``, and the cameras that ``transientcam devices`` lists."""

import json
from dataclasses import asdict
from typing import Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from transientcam_driver.cli.options import JsonOption
from transientcam_driver.errors import LibusbMissing
from transientcam_driver.simulation import list_scenes
from transientcam_driver.usb import list_cameras


def scenes(as_json: JsonOption = False) -> None:
    """List the scenes of the simulated camera."""
    infos = list_scenes()
    if as_json:
        fields = [
            {"name": info.name, "description": info.description, "path": str(info.path)}
            for info in infos
        ]
        typer.echo(json.dumps(fields, indent=2))
        return
    table = Table("scene", "what it shows", box=None)
    for info in infos:
        table.add_row(f"sim:{info.name}", escape(info.description))
    Console().print(table)


def plugged_in() -> dict[str, Any]:
    """Return what `transientcam devices` lists of this machine.

    ``cameras``: those on USB, each with the ``spec`` that opens it; ``problem``: why USB cannot be
    used, or None; ``simulated``: the specs of the built-in scenes.
    """
    problem: str | None = None
    try:
        cameras = list_cameras()
    except LibusbMissing as error:
        cameras, problem = (), str(error)
    return {
        "cameras": [asdict(camera) | {"spec": camera.spec} for camera in cameras],
        "problem": problem,
        "simulated": [f"sim:{info.name}" for info in list_scenes()],
    }
