"""Verbs of the ``transientcam`` command that the driver brings along."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from transientcam_driver.errors import LibusbMissing
from transientcam_driver.simulation import list_scenes
from transientcam_driver.usb import UsbCamera, list_cameras

_Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def scenes(as_json: _Json = False) -> None:
    """List the scenes that the simulated camera knows."""
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


def devices(as_json: _Json = False) -> None:
    """List the cameras that are plugged in, and how to open them."""
    libusb: str | None = None
    try:
        cameras = list_cameras()
    except LibusbMissing as error:
        cameras, libusb = (), str(error)
    simulated = [f"sim:{info.name}" for info in list_scenes()]
    if as_json:
        document = {
            "cameras": [asdict(camera) | {"spec": camera.spec} for camera in cameras],
            "problem": libusb,
            "simulated": simulated,
        }
        typer.echo(json.dumps(document, indent=2))
        return
    console = Console()
    if cameras:
        console.print(_table(cameras))
    else:
        console.print(escape(libusb or "No camera is plugged in."), soft_wrap=True)
    for camera in cameras:
        if camera.problem is not None:
            console.print(f"{camera.node}: {escape(camera.problem)}", soft_wrap=True)
    console.print(f"Simulated ones: {', '.join(simulated)} (transientcam scenes)", soft_wrap=True)


def _table(cameras: tuple[UsbCamera, ...]) -> Table:
    table = Table("camera", "serial number", "product", "node", box=None)
    for camera in cameras:
        fields = (camera.spec, camera.serial or "?", camera.product or "?", camera.node)
        table.add_row(*map(escape, fields))
    return table
