"""``transientcam doctor``: checks of this machine or of a daemon, with a remedy for each fault."""

import json
import os
import platform
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from itertools import chain
from pathlib import Path
from typing import Annotated, Final

import typer

from transientcam.cli import daemon_checks, findings
from transientcam.cli.findings import Finding, Level
from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import Terminal, Text, echo

_STYLES: Final[dict[Level, str]] = {
    "ok": "green",
    "warning": "yellow",
    "fault": "bold red",
    "not tried": "dim",
}
_WIDTH = 20
_FORM: Final = """What I did and saw (camera, cable, distance of a wall by tape and by program):


```text
{told}```
"""


def doctor(
    url: Annotated[
        str | None,
        typer.Argument(metavar="[URL]", help="A daemon to check; without it, this machine."),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            help="A camera to open and to hold to the contract of all cameras; its light goes on."
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="Settings in TOML.  [default: as `transientcam serve`]")
    ] = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="How long to watch the daemon's stream.")
    ] = 2.0,
    timeout_s: Annotated[
        float, typer.Option(min=0.1, help="How long to wait for each of its answers.")
    ] = 10.0,
    report: Annotated[
        Path | None, typer.Option(help="Also write what was found into this .md, for an issue.")
    ] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check this machine, a daemon or a camera, and print a remedy for each fault.

    Exits with 0 if there is no fault (warnings are allowed), with 1 otherwise.
    """
    if url is not None and camera is not None:
        raise typer.BadParameter("is for a camera without a daemon", param_hint="--camera")
    if camera is not None:
        found = chain(_of_client(), findings.of_camera(camera))
    elif url is None:
        found = chain(_of_client(), findings.of_this_machine(config))
    else:
        found = chain(
            _of_client(),
            daemon_checks.of_daemon(url, token=token, seconds=seconds, timeout_s=timeout_s),
        )
    conclude(found, as_json=as_json, report=report)


def kinect2(
    check: Annotated[
        bool, typer.Option("--check", help="Host, USB controller, cable and usbfs memory.")
    ] = False,
    root: Annotated[Path, typer.Option(help="Where /sys, /proc and /dev are.")] = Path("/"),
    as_json: JsonOption = False,
) -> None:
    """Check what this machine allows a Kinect v2, whether one is plugged in or not.

    Nothing is opened. Exits as `transientcam doctor` does.
    """
    if not check:
        raise typer.BadParameter("is all this verb does", param_hint="--check")
    conclude(findings.of_kinect2(root), as_json=as_json)


def conclude(found: Iterable[Finding], *, as_json: bool, report: Path | None = None) -> None:
    """Print findings, write them into a file for an issue, and exit with 1 if there is a fault."""
    seen = _tell_as_json(found) if as_json else _tell(found)
    if report is not None:
        told = "".join(f"- {each.level}, {each.check}: {each.message}\n" for each in seen)
        for ours, shown in ((os.environ.get("HOME", ""), "~"), (platform.node(), "HOST")):
            told = told.replace(ours, shown) if len(ours) > 1 else told
        report.write_text(_FORM.format(told=told.replace("`", "'")), encoding="utf-8")
    if any(each.level == "fault" for each in seen):
        raise typer.Exit(code=1)


def _of_client() -> Iterator[Finding]:
    yield Finding("ok", "Python", f"{platform.python_version()} on {platform.platform()}")
    libraries = ("transientcam", "numpy", "httpx", "websockets", "msgpack")
    yield Finding("ok", "packages", ", ".join(f"{each} {version(each)}" for each in libraries))


def _tell_as_json(found: Iterable[Finding]) -> list[Finding]:
    seen = list(found)
    levels = [each.level for each in seen]
    worst = next(level for level in ("fault", "warning", "ok") if level in levels)
    untried = [each.check for each in seen if each.level == "not tried"]
    listed = [each.to_document() for each in seen]
    document = {"verdict": worst, "not_tried": untried, "findings": listed}
    echo(json.dumps(document, indent=2))
    return seen


def _tell(found: Iterable[Finding]) -> list[Finding]:
    """Print findings as they come: some take a while."""
    console = Terminal(highlight=False)
    seen = []
    for each in found:
        seen.append(each)
        level = f"{each.level:<7} "
        line = Text.assemble((level, _STYLES[each.level]), f"{each.check:<{_WIDTH - len(level)}} ")
        console.print(line + Text(each.message))
        if each.remedy is not None:
            indent = " " * (_WIDTH + 1)
            for remedy in each.remedy.splitlines():
                console.print(Text(f"{indent}{remedy}", style="dim"))
    counts = (f"{level}: {sum(each.level == level for each in seen)}" for level in _STYLES)
    console.print(f"{', '.join(counts)}.")
    return seen
