"""What the process that reads a stranger's file may do instead, for tests; light to import."""

import os
import signal
from pathlib import Path


def crash(*_: object) -> None:
    """End as libhdf5 does where it trips."""
    os.abort()


def lie(*_: object) -> str:
    """Name a file elsewhere, as code that has taken the process over might."""
    return "../../elsewhere"


def hang(sent: Path, *_: object) -> None:
    """Say which process this is, and never return."""
    begun = sent.with_name("hanging.tmp")
    begun.write_text(str(os.getpid()))
    begun.rename(sent.with_name("hanging"))
    signal.pause()
