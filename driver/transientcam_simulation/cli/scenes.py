"""The verb ``scenes``."""

import json

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo
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
    rows = ((f"sim:{info.name}", info.description) for info in infos)
    Terminal().table("scene", "what it shows", rows=rows)
