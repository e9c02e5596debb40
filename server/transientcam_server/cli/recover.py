"""The verb ``recover`` of the ``transientcam`` command."""

import json
from pathlib import Path
from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo


def recover(
    path: Annotated[
        Path,
        typer.Argument(metavar="PATH", help="An unfinished recording (.part), or a directory."),
    ],
    as_json: JsonOption = False,
) -> None:
    """Recover the unfinished recordings of a killed service; its next start does the same."""
    from transientcam_server.recording import recovery

    with Terminal(stderr=True).status("recovering"):
        if path.is_dir():
            parts = recovery.unfinished(path)
            recovered = recovery.recover_all(parts)
        else:
            parts, recovered = [path], [recovery.recover(path)]
    if as_json:
        left = [str(part) for part in parts if part.exists()]
        echo(json.dumps({"recovered": [str(each) for each in recovered], "left": left}))
    else:
        for each in recovered:
            echo(f"recovered {each}")
        echo(f"{len(recovered)} of {len(parts)} recovered")
    if len(recovered) < len(parts):
        raise typer.Exit(code=1)
