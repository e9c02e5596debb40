"""README's blocks, pasted whole: one after the other, by someone who has nothing else.

What takes minutes or a network is replaced, and checked another way: ``make install`` is not run,
but the programs find no package that it would not install. The service has a port of its own, no
compiler and so a quick estimator, and records for half a second.
"""

import json
import re
import socket
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np

from tests.conftest import ROOT
from tests.packaging.test_lock import OURS, locked

README = (ROOT / "README.md").read_text("utf-8")
BLOCKS = re.findall(r"^```(sh|python)\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
PORT = "8000"
QUICKER = {"--duration 10": "--duration 0.5", "--count 20": "--count 3"}
REFUSE = """
import importlib.abc, sys

class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name in {absent!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Refuse())
"""


def absent() -> list[str]:
    """Return the packages that are here, and that ``make install`` would not have installed."""
    present = {*locked("build"), *locked("service"), *OURS, "pip"}
    return sorted(
        module
        for module, distributions in packages_distributions().items()
        if not present & {each.lower().replace("_", "-") for each in distributions}
    )


def test_make_install_installs_the_lock_that_the_blocks_are_held_to() -> None:
    command = ["make", "--dry-run", "--always-make", "install"]
    planned = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout

    assert "--requirement requirements/service.txt" in planned
    assert "requirements/test.txt" not in planned
    assert {"pytest", "h5netcdf", "marimo"} <= {*absent()}


def test_blocks_pasted_whole_run_to_their_end(tmp_path: Path) -> None:
    """In a directory that has what a checkout has, and no home but itself."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    programs = tmp_path / "programs"
    programs.mkdir()
    made = {"make": '[ "$*" = install ]', "browser": 'echo "$1" >"$HOME/opened"'}
    for name, line in made.items():
        (programs / name).write_text(f"#!/bin/sh\n{line}\n")
        (programs / name).chmod(0o755)
    (programs / "sitecustomize.py").write_text(REFUSE.format(absent=set(absent())))
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    script = "set -e\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n"
    for number, (kind, block) in enumerate(BLOCKS):
        text = block.replace(f"127.0.0.1:{PORT}", f"127.0.0.1:{port}")
        for slow, quick in QUICKER.items():
            text = text.replace(slow, quick)
        if kind == "python":
            text = f".venv/bin/python - <<'EOF{number}'\n{text}EOF{number}\n"
        script += text
    script += "wait\n"

    done = subprocess.run(
        ["bash"],
        input=script,
        cwd=tmp_path,
        env={
            "PATH": f"{programs}:/usr/bin:/bin",
            "HOME": str(tmp_path),
            "BROWSER": "browser",
            "PYTHONPATH": str(programs),
            "TRANSIENTCAM_PORT": port,
            "TRANSIENTCAM_KERNELS": "off",
            "TRANSIENTCAM_RECONSTRUCTION__ESTIMATOR": "pisarenko",
            "TRANSIENTCAM_RECONSTRUCTION__NEIGHBOURS": "gaussian",
        },
        capture_output=True,
        text=True,
        timeout=200,
        process_group=0,
        check=False,
    )

    assert done.returncode == 0, script + done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "opened").read_text() == f"http://127.0.0.1:{port}\n"
    assert (tmp_path / "range.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "transient.png").read_bytes().startswith(b"\x89PNG")
    assert np.load(tmp_path / "transient.npz")["range_m"].ndim == 2
    store = json.loads((tmp_path / "range.zarr" / "range" / "zarr.json").read_text())
    assert store["shape"][1:] == [120, 163]
