"""``transientcam`` on a disk that does not answer while a file is there: the first argument."""

import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from transientcam.cli import run


def _hanging(call: Callable[..., Any], hangs: Path) -> Callable[..., Any]:
    def waiting(*arguments: Any) -> Any:
        if hangs.exists() and threading.current_thread().name == "recorder":
            threading.Event().wait()
        return call(*arguments)

    return waiting


def main() -> int:
    """Do as the command line says."""
    hangs = Path(sys.argv[1])
    for name in ("pwrite", "fsync"):
        setattr(os, name, _hanging(getattr(os, name), hangs))
    return run(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
