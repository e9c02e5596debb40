"""Import laws as import-linter has them need private names: here is what has to have one."""

import importlib
import pkgutil
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ENTRY_POINTS = {"cli", "entries"}
"""Rooms of entry points, whose files pyproject.toml names."""
PACKAGES = (
    "transientcam",
    "transientcam_conformance",
    "transientcam_driver",
    "transientcam_moments",
    "transientcam_oak",
    "transientcam_opt8241",
    "transientcam_server",
    "transientcam_simulation",
)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="this is no repository")
def test_every_test_stands_in_one_place() -> None:
    command = ["git", "ls-files"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    named = re.compile(r"(^|/)(test_[^/]*\.py|[^/]*_test\.py|[^/]*\.(test|spec)\.tsx?)$")
    tests = [file for file in done.stdout.splitlines() if named.search(file)]

    assert [file for file in tests if file.endswith(".test.ts")]
    assert [file for file in tests if not file.startswith("tests/")] == []


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
