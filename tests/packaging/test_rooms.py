"""Import laws as import-linter has them need private names: here is what has to have one."""

import importlib
import pkgutil
from pathlib import Path

import pytest

ENTRY_POINTS = {"cli", "entries"}
"""Rooms of entry points, whose files pyproject.toml names."""
PACKAGES = (
    "transientcam",
    "transientcam_conformance",
    "transientcam_driver",
    "transientcam_moments",
    "transientcam_opt8241",
    "transientcam_server",
    "transientcam_simulation",
)


def _folder(package: str) -> Path:
    (folder,) = importlib.import_module(package).__path__
    return Path(folder)


@pytest.mark.parametrize("package", PACKAGES)
def test_each_file_of_a_room_is_private(package: str) -> None:
    root = _folder(package)
    inside = (file.relative_to(root) for file in root.rglob("*.py"))
    public = [
        str(file)
        for file in inside
        if len(file.parts) > 1
        and file.parts[0] not in ENTRY_POINTS
        and not any(part.startswith("_") for part in file.parts)
    ]

    assert public == []


@pytest.mark.parametrize("package", PACKAGES)
def test_each_name_that_a_room_shows_is_there(package: str) -> None:
    rooms = (
        each.name
        for each in pkgutil.walk_packages([str(_folder(package))], f"{package}.")
        if each.ispkg
    )
    missing = [
        f"{room}.{name}"
        for room in rooms
        for name in getattr(importlib.import_module(room), "__all__", ())
        if not hasattr(importlib.import_module(room), name)
    ]

    assert missing == []
