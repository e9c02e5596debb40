"""Which lanes this process has: read by every call, written by the thread that compiles.

What compiles is set from above: lanes are compiled of functions of modules that look lanes up.
"""

import os
import threading
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from transientcam_moments._lanes.helper import Helper

PRECISIONS = {"f": "f", "F": "f", "d": "d", "D": "d"}  # of an array's type, by its character
LEAST_PIXELS = 64  # what the widest lane takes at a time
HEAVY_PIXELS = 4096  # from which a call is worth a lane that it does not find
PRECISION_NAMES = {"float32": "f", "float64": "d"}


class Key(NamedTuple):
    """What a lane is compiled for."""

    name: str
    harmonics: int
    precision: str

    def __str__(self) -> str:
        """As in "levinson m=4 float32"."""
        precision = {code: name for name, code in PRECISION_NAMES.items()}[self.precision]
        return f"{self.name} m={self.harmonics} {precision}"


Lane = Callable[..., Any]


class Registry:
    """The compiled lanes of a process and how far compiling has come.

    Written under ``lock`` by one compiling thread at a time; ``compiled`` is read without it.

    Attributes
    ----------
    noting
        What calls want is made ready only when that is asked for.
    make
        Returns the lane of a key: loaded from the cache or compiled, by another process where one
        is given. None where the program ends meanwhile.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        """Read ``TRANSIENTCAM_KERNELS``: "off" (or 0, no, false) leaves everything to NumPy.

        With "manual" there is nothing but what the process itself compiles.
        """
        setting = environ.get("TRANSIENTCAM_KERNELS", "on").strip().lower()
        self.enabled = setting not in ("off", "0", "no", "false")
        self.automatic = self.enabled and setting != "manual"
        self.noting = False
        self.lock = threading.Lock()
        self.compiled: dict[Key, Lane] = {}
        self.compiling: Key | None = None
        self.failed: dict[Key, str] = {}
        self.make: Callable[[Key, Helper | None], Lane | None]


# The one place that reads the environment; a process has one set of machine code.
REGISTRY = Registry(os.environ)
