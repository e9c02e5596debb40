"""The verb ``kinect2`` of the ``transientcam`` command: what this machine allows a Kinect v2."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from transientcam.cli.doctor import conclude
from transientcam.cli.findings import guarded
from transientcam.cli.options import JsonOption
from transientcam_driver.cli import kinect2_checks


def kinect2(
    check: Annotated[
        bool, typer.Option("--check", help="Check host, controller, cable and usbfs memory.")
    ] = False,
    root: Annotated[Path, typer.Option(help="Where /sys, /proc and /dev are found.")] = Path("/"),
    as_json: JsonOption = False,
) -> None:
    """Check what this machine allows a Kinect v2, whether one is plugged in or not.

    Nothing is opened. Exits with 0 if there is no fault, with 1 otherwise.
    """
    if not check:
        raise typer.BadParameter("is all this verb does", param_hint="--check")
    checks = partial(kinect2_checks.checks, root=root, host=True)
    conclude(guarded(kinect2_checks.NAME, checks), as_json=as_json)
