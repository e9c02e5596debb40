"""Scenes of responses that others measured or rendered, where these are at hand."""

import os
from pathlib import Path
from typing import Final

from benchmarks.common.records import ROOT

_DEFAULT: Final = ROOT.parent / "shared" / "data"
COMPOSITE: Final = """
name = "composite"
description = "One photon-counting measurement and two through foam, one after the other"
[light]
electrons_per_s = 1.0e7
[[response]]
file = "{data}/measured/capture_direct.npz"
background = "median"
time_zero_file = "{data}/measured/capture_direct.npz"
weight = 0.55
delay_s = 3e-9
[[response]]
file = "{data}/measured/capture_1_0_inch.npz"
background = "median"
time_zero_file = "{data}/measured/capture_direct.npz"
weight = 0.30
delay_s = 9e-9
[[response]]
file = "{data}/measured/capture_3_0_inch.npz"
background = "median"
time_zero_file = "{data}/measured/capture_direct.npz"
weight = 0.5
delay_s = 20e-9
"""


def data_folder() -> Path | None:
    """Return the folder that TRANSIENTCAM_TEST_DATA names, or the usual one, if it is there."""
    data = Path(os.environ.get("TRANSIENTCAM_TEST_DATA", _DEFAULT)).resolve()
    return data if data.is_dir() else None


def composite_scene(folder: Path) -> str | None:
    """Write the measured composite as a scene into a folder, if the data are there."""
    data = data_folder()
    if data is None or not (data / "measured" / "capture_direct.npz").is_file():
        return None
    path = folder / "composite.toml"
    path.write_text(COMPOSITE.format(data=data), encoding="utf-8")
    return str(path)


def cornell_scene() -> str | None:
    """Name the rendered Cornell box as a scene, if it is there."""
    data = data_folder()
    path = None if data is None else data / "rendered" / "mitransient_cornell_163x120x300.npz"
    return f"measured:{path}" if path is not None and path.is_file() else None
