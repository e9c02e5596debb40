"""``transientcam devices``: the cameras here and on the network, and what opens each.

Each kind of camera lists its own, through its entry point of the group ``transientcam.cameras``.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from datetime import datetime
from importlib.metadata import EntryPoint, entry_points
from itertools import chain
from typing import Annotated, Any, Final, Literal

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo
from transientcam.cli.verbs import extra_of
from transientcam.discovery import FoundCamera, discover
from transientcam.errors import CommandUnavailable, ServerUnreachable

GROUP: Final = "transientcam.cameras"
_VERB: Final = "devices"
_PRODUCTS: Final = (
    "Products that one cannot give: transientcam doctor --camera CAMERA (its light goes on), "
    "or transientcam doctor ADDRESS for one on the network"
)


def devices(
    network: Annotated[bool, typer.Option(help="Also search the network.")] = True,
    timeout_s: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="How long to listen there.")
    ] = 2.0,
    interface: Annotated[
        list[str] | None,
        typer.Option(help="Search only on the interface of this address; may be repeated."),
    ] = None,
    watch: Annotated[
        bool,
        typer.Option("--watch", help="Print services as they appear and disappear, until Ctrl-C."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """List the cameras that each plug-in finds, those on the network, and how to open each.

    Nothing is opened for that, so that neither frequencies nor products are known:
    `transientcam doctor --camera CAMERA`, or `transientcam doctor URL` for one on the network,
    lists the products that it cannot give, each with the reason.
    """
    if watch:
        print_changes(lambda: _searched(timeout_s, interface), now=datetime.now, as_json=as_json)
    document = {**cameras_here(network=network), "network": [], "network_problem": None}
    console = Terminal(stderr=True)
    if network:
        with console.status("listening on the network"):
            found, problem = _announced(timeout_s, interface)
        document |= {"network": [asdict(each) for each in found], "network_problem": problem}
    if as_json:
        echo(json.dumps(document, indent=2))
    else:
        _print(document, network=network)


def cameras_here(*, network: bool) -> dict[str, Any]:
    """Return the kinds of cameras, what each finds, and why one could not look."""
    document: dict[str, Any] = {"kinds": [], "cameras": [], "problems": {}, "simulated": []}
    for point in sorted(entry_points(group=GROUP), key=lambda each: each.name):
        try:
            _look(point, document, network=network)
        except ModuleNotFoundError as error:
            extra = extra_of(error.name or "", _VERB) or extra_of(point.module, _VERB)
            missing = CommandUnavailable(_VERB, error.name or "", extra)
            document["problems"][point.name] = str(missing)
        except (
            Exception,
            SystemExit,
        ) as error:  # one plug-in, of any package, must not hide the others
            # an error that was raised on purpose is a sentence; any other needs its name
            ours = type(error).__module__.startswith("transientcam")
            text = str(error) if ours else f"{type(error).__name__}: {error}"
            document["problems"][point.name] = text
    return document


def _look(point: EntryPoint, document: dict[str, Any], *, network: bool) -> None:
    plugin = point.load()
    document["kinds"].append(
        {
            "name": point.name,
            "usage": plugin.usage,
            "summary": plugin.summary,
            "options": dict(plugin.options),
        }
    )
    elsewhere = plugin.find_on_network() if network else ()
    for camera in chain(plugin.find(), elsewhere):
        found = asdict(camera)
        if found.pop("simulated"):
            document["simulated"].append(camera.spec)
        else:
            document["cameras"].append({"kind": point.name, **found})


def _searched(timeout_s: float, interfaces: list[str] | None) -> tuple[FoundCamera, ...]:
    """Return what announces itself; without a network there is nothing to watch."""
    found, problem = _announced(timeout_s, interfaces)
    if problem is not None:
        echo(problem, err=True)
        raise typer.Exit(code=1)
    return found


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
    console = Terminal()
    cameras, announced = document["cameras"], document["network"]
    if document["kinds"]:
        kinds = ((kind["usage"], kind["summary"]) for kind in document["kinds"])
        console.table("name of a camera", "what it opens", rows=kinds)
        console.print()
    if cameras:
        rows = _rows(cameras, "spec", "serial", "product", "node")
        console.table("camera", "serial number", "product", "at", rows=rows)
    else:
        console.print("No camera was found.")
    for camera in cameras:
        if camera["problem"] is not None:
            where = camera["node"] or camera["spec"]
            console.print(f"{where}: {camera['problem']}")
    for kind, problem in document["problems"].items():
        console.print(f"{kind}: {problem}")
    if announced:
        rows = _rows(announced, "url", "serial", "firmware", "state", "name")
        console.table("address", "serial number", "firmware", "state", "name", rows=rows)
    elif network:
        message = document["network_problem"] or "No camera announces itself on the network."
        console.print(message)
    if cameras or announced:
        console.print(_PRODUCTS)
    if document["simulated"]:
        simulated = ", ".join(document["simulated"])
        console.print(f"Simulated ones: {simulated} (transientcam scenes)")


def _rows(cameras: list[dict[str, Any]], *names: str) -> list[list[str]]:
    return [[camera[name] or "?" for name in names] for camera in cameras]


Change = Literal["here", "gone"]
MISSED: Final = 3
"""Searches in a row without an answer until a daemon counts as gone: mDNS may lose a packet."""


class Presence:
    """Who was found so far, and who of them is still there."""

    def __init__(self) -> None:
        self._known: dict[FoundCamera, int] = {}

    def update(self, found: Iterable[FoundCamera]) -> Iterator[tuple[Change, FoundCamera]]:
        """Take the result of a search, and return what has changed; a new address is a new one."""
        present = set(found)
        for camera in sorted(present - self._known.keys(), key=lambda each: each.name):
            yield "here", camera
        missing = {camera: missed + 1 for camera, missed in self._known.items()}
        self._known = missing | dict.fromkeys(present, 0)
        for camera in [each for each, missed in self._known.items() if missed == MISSED]:
            del self._known[camera]
            yield "gone", camera


def print_changes(
    search: Callable[[], Iterable[FoundCamera]], *, now: Callable[[], datetime], as_json: bool
) -> None:
    """Search again and again, and print a line for each change, until it is interrupted."""
    presence = Presence()
    while True:
        for change, camera in presence.update(search()):
            time = now().isoformat(sep=" ", timespec="seconds")
            if as_json:
                echo(json.dumps({"time": time, "change": change, **asdict(camera)}))
            else:
                echo(f"{time}  {change}  {camera.url}  {camera.serial or '?'}  {camera.name}")
