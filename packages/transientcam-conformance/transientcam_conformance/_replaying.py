"""A second daemon beside the one that is checked, where its packages are installed."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from transientcam_conformance._expecting import expect

_PROGRAM = "from transientcam.cli import main; main()"
_END_S = 20.0


def can_replay() -> bool:
    """Return whether a daemon can be started here."""
    return find_spec("transientcam_server") is not None


@contextmanager
def replayed(file: Path) -> Iterator[str]:
    """Serve a recording, over and over, for the length of a block; yields the address."""
    settings = file.with_suffix(".toml")
    settings.touch()  # so that no other settings are found
    environment = {k: v for k, v in os.environ.items() if not k.startswith("TRANSIENTCAM_")}
    environment |= {"TRANSIENTCAM_KERNELS": "off", "XDG_DATA_HOME": str(file.parent)}
    arguments = ["serve", "--camera", f"recording:{file}?loop=on", "--port", "0"]
    with subprocess.Popen(  # noqa: S603 - this very interpreter and package
        [sys.executable, "-c", _PROGRAM, *arguments, "--config", str(settings)],
        cwd=file.parent,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None  # noqa: S101 - it is a pipe
            found = re.search(r"http://\S+:\d+", process.stdout.readline())
            expect(found, "the recording cannot be replayed: the second daemon does not start")
            yield found.group() if found else ""
        finally:
            process.terminate()
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
