"""What the verb ``calibrate`` does with ``--noise``: the noise of a sensor by photon transfer."""

import json
from pathlib import Path
from typing import Any, Final

from rich.progress import Progress

from transientcam.cli.options import require_suffix
from transientcam.cli.terminal import Terminal, echo
from transientcam_driver import open_camera
from transientcam_server.camera import measure_photon_transfer
from transientcam_server.offline import plot

_SETTINGS: Final = ("gain_e_per_dn", "full_well_e", "read_noise_e", "dark_dn")


def measure_noise(spec: str, frames: int, output: Path | None, *, as_json: bool) -> None:
    """Measure with a camera of this machine, print the figures, and write what the suffix says."""
    require_suffix(output, ".toml", ".json", ".png")
    suffix = "" if output is None else output.suffix.lower()
    if suffix == ".png":
        plot.require("--output")
    with open_camera(spec) as camera, Progress(console=Terminal(stderr=True)) as shown:
        task = shown.add_task("capturing", total=1.0)
        found = measure_photon_transfer(
            camera, frames=frames, go_on=lambda share: shown.update(task, completed=share)
        )
    document = found.to_document()
    if output is not None and suffix == ".png":
        plot.save_photon_transfer(output, document)
    elif output is not None:
        settings = [f"{name} = {document['sensor'][name]:.6g}\n" for name in _SETTINGS]
        toml = "".join(["[sensor]\n", *settings])
        output.write_text(json.dumps(document) if suffix == ".json" else toml)
    echo(json.dumps(document) if as_json else _in_words(document))


def _in_words(result: dict[str, Any]) -> str:
    """State the figures by the names of EMVA 1288."""
    sensor, found = result["sensor"], result["emva1288"]
    full = "" if found["saturation_seen"] else ", the end of the converter: no pixel was full"
    return (
        f"{len(result['signal_dn'])} points of signal and variance (photon transfer, EMVA 1288)\n"
        f"  system gain K {found['system_gain_dn_per_e']:.4g} DN/e "
        f"(+- {found['system_gain_uncertainty']:.1%}), {sensor['gain_e_per_dn']:.4g} e/DN\n"
        f"  temporal dark noise {found['temporal_dark_noise_e']:.3g} e, "
        f"of it read noise {sensor['read_noise_e']:.3g} e\n"
        f"  dark level {found['dark_level_dn']:.4g} DN\n"
        f"  saturation capacity {found['saturation_capacity_e']:.4g} e{full}\n"
        f"  SNR at most {found['snr_max_db']:.1f} dB, "
        f"dynamic range {found['dynamic_range_db']:.1f} dB"
    )
