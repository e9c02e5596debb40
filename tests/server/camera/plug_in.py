"""Plug-ins of the documentation, installed by pip as distributions of their own."""

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "add-a-camera.md"


def block(language: str) -> str:
    """Return the page's first block of code in a language."""
    return PAGE.read_text(encoding="utf-8").split(f"```{language}\n")[1].split("```")[0]


def install(directory: Path) -> Path:
    """Install what the page shows below a directory, without a network; return where."""
    return install_package(directory, block("toml"), {"wall_camera.py": block("python")})


def install_package(directory: Path, described: str, modules: dict[str, str]) -> Path:
    """Install modules, as their pyproject.toml describes them, below a directory; return where."""
    project = tomllib.loads(described)["project"]
    groups = project["entry-points"].items()
    points = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
        for group, entries in groups
    )
    about = project["name"].replace("-", "_") + "-" + project["version"]
    files = {
        **modules,
        f"{about}.dist-info/METADATA": (
            f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        ),
        f"{about}.dist-info/WHEEL": (
            "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        ),
        f"{about}.dist-info/entry_points.txt": points,
    }
    record = f"{about}.dist-info/RECORD"
    listed = "".join(f"{name},,\n" for name in (*files, record))
    wheel = directory / f"{about}-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for name, content in (*files.items(), (record, listed)):
            archive.writestr(name, content)
    site = directory / "site"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--target", str(site), str(wheel)], check=True)
    return site
