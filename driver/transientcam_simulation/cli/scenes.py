"""The verb ``scenes``."""

import json

from rich.table import Table

from transientcam.cli.terminal import Terminal, echo
from transientcam_driver.cli.options import JsonOption
from transientcam_simulation import list_scenes


def scenes(as_json: JsonOption = False) -> None:
    """List the scenes of the simulated camera."""
    infos = list_scenes()
    if as_json:
        fields = [
            {"name": info.name, "description": info.description, "path": str(info.path)}
            for info in infos
        ]
        echo(json.dumps(fields, indent=2))
        return
    table = Table("scene", "what it shows", box=None)
    for info in infos:
        table.add_row(f"sim:{info.name}", info.description)
    Terminal().print(table)
