"""Scenes of responses that others measured or rendered, where these are at hand."""

import os
from pathlib import Path
from typing import Final

from benchmarks.common.records import ROOT

_DEFAULT: Final = ROOT.parent / "shared" / "data"


def data_folder() -> Path | None:
    """Return the folder that TRANSIENTCAM_TEST_DATA names, or the usual one, if it is there."""
    data = Path(os.environ.get("TRANSIENTCAM_TEST_DATA", _DEFAULT)).resolve()
    return data if data.is_dir() else None


def composite_scene(folder: Path) -> str | None:
    """Write the measured composite as a scene into a folder, if the data are there."""
    data = data_folder()
    if data is None or not (data / "measured" / "capture_direct.npz").is_file():
        return None
    stated = Path(__file__).with_name("composite.toml").read_text(encoding="utf-8")
    path = folder / "composite.toml"
    path.write_text(stated.replace("{data}", str(data)), encoding="utf-8")
    return str(path)


def cornell_scene() -> str | None:
    """Name the rendered Cornell box as a scene, if it is there."""
    data = data_folder()
    path = None if data is None else data / "rendered" / "mitransient_cornell_163x120x300.npz"
    return f"measured:{path}" if path is not None and path.is_file() else None
