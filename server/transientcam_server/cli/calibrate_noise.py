"""What the verb ``calibrate`` does with ``--noise``: the noise of a sensor by photon transfer."""

import json
from pathlib import Path

from transientcam.cli.terminal import Terminal, echo
from transientcam_driver import open_camera
from transientcam_server.camera import measure_photon_transfer
from transientcam_server.settings import SensorSettings


def measure_noise(spec: str, frames: int, output: Path | None, *, as_json: bool) -> None:
    """Measure with a camera of this machine; the figures of EMVA 1288, and settings for `serve`."""
    with open_camera(spec) as camera, Terminal(stderr=True).status("capturing"):
        document = measure_photon_transfer(camera, frames=frames).to_document()
    figures = [f"# {name} = {value:.4g}" for name, value in document["emva1288"].items()]
    sensor = [f"{name} = {document['sensor'][name]:.6g}" for name in SensorSettings.model_fields]
    text = json.dumps(document) if as_json else "\n".join([*figures, "[sensor]", *sensor])
    if output is None:
        echo(text)
    else:
        output.write_text(text + "\n")
