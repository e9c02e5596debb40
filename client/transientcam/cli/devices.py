"""``transientcam devices``: cameras on USB and on the network, and what opens each.

The list of USB cameras comes from the driver, through the entry point ``usb`` of the group
``transientcam.devices``.
"""

import json
from dataclasses import asdict
from importlib.metadata import entry_points
from typing import Annotated, Any, Final

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from transientcam.cli.options import JsonOption
from transientcam.discovery import FoundCamera, discover
from transientcam.errors import CommandUnavailable, ServerUnreachable

GROUP: Final = "transientcam.devices"
_VERB: Final = "devices"


def devices(
    network: Annotated[bool, typer.Option(help="Whether to look on the network, too.")] = True,
    timeout_s: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="How long to listen there.")
    ] = 2.0,
    interface: Annotated[
        list[str] | None,
        typer.Option(help="Search only on the interface of this address; may be repeated."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the cameras on USB and on the network, and how to open each."""
    document = {**_plugged_in(), "network": [], "network_problem": None}
    console = Console(stderr=True)
    if network:
        with console.status("listening on the network"):
            found, problem = _announced(timeout_s, interface)
        document |= {"network": [asdict(each) for each in found], "network_problem": problem}
    if as_json:
        typer.echo(json.dumps(document, indent=2))
    else:
        _print(document, network=network)


def _plugged_in() -> dict[str, Any]:
    """Return the cameras that the driver finds, or how to install the driver."""
    try:
        for point in entry_points(group=GROUP, name="usb"):
            found: dict[str, Any] = point.load()()
            return found
        missing = "transientcam_driver"
    except ModuleNotFoundError as error:
        missing = error.name or ""
    problem = str(CommandUnavailable(_VERB, missing, "driver"))
    return {"cameras": [], "problem": problem, "simulated": []}


def _announced(
    timeout_s: float, interfaces: list[str] | None
) -> tuple[tuple[FoundCamera, ...], str | None]:
    try:
        return discover(timeout_s=timeout_s, interfaces=interfaces), None
    except ModuleNotFoundError as error:
        return (), str(CommandUnavailable(_VERB, error.name or "", "discovery"))
    except ServerUnreachable as error:
        return (), f"The network cannot be searched: {error.reason}"


def _print(document: dict[str, Any], *, network: bool) -> None:
    console = Console()
    plugged, announced = document["cameras"], document["network"]
    if plugged:
        console.print(_usb_table(plugged))
    else:
        console.print(escape(document["problem"] or "No camera is plugged in."), soft_wrap=True)
    for camera in plugged:
        if camera["problem"] is not None:
            console.print(f"{camera['node']}: {escape(camera['problem'])}", soft_wrap=True)
    if announced:
        console.print(_network_table(announced))
    elif network:
        message = document["network_problem"] or "No camera announces itself on the network."
        console.print(escape(message), soft_wrap=True)
    if document["simulated"]:
        simulated = ", ".join(document["simulated"])
        console.print(f"Simulated ones: {simulated} (transientcam scenes)", soft_wrap=True)


def _usb_table(cameras: list[dict[str, Any]]) -> Table:
    table = Table("camera", "serial number", "product", "node", box=None)
    for camera in cameras:
        fields = (camera["spec"], camera["serial"] or "?", camera["product"] or "?", camera["node"])
        table.add_row(*map(escape, fields))
    return table


def _network_table(cameras: list[dict[str, Any]]) -> Table:
    table = Table("address", "serial number", "firmware", "name", box=None)
    for camera in cameras:
        fields = (camera["url"], camera["serial"] or "?", camera["firmware"] or "?", camera["name"])
        table.add_row(*map(escape, fields))
    return table
