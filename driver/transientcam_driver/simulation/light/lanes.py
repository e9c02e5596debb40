"""Compiled lanes beside this folder's arithmetic: the same bytes, used once they are ready.

A lane stands beside a statement in NumPy, which serves until a background thread has compiled all
of them or loaded them from the cache: no image waits for a compiler. Importing this module imports
none. The driver does not depend on numba; without it NumPy goes on serving.
"""

import logging
import os
import threading
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Final

THREAD: Final = "transientcam-compile-light"
"""Name of the thread that compiles."""
COMPILED: Final = (
    "compiled_images",
    "light.compiled_chunks",
    "light.compiled_edges",
    "light.compiled_light",
    "light.compiled_tiles",
)
"""Modules of lanes."""
CHUNK: Final = 64
"""Points or pixels that lanes take at a time, which are mostly beside each other in a row."""
_log = logging.getLogger("transientcam_driver")


class Lanes:
    """The compiled lanes of a process.

    ``TRANSIENTCAM_KERNELS``: "off" (or 0, no, false) leaves everything to NumPy; with "manual"
    nothing is compiled but by `compile_now`.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        setting = environ.get("TRANSIENTCAM_KERNELS", "on").strip().lower()
        self._automatic = setting not in ("off", "0", "no", "false", "manual")
        self._starting = threading.Lock()
        self._ready: dict[str, Callable[..., Any]] = {}

    def find(self, name: str) -> Callable[..., Any] | None:
        """Return a lane, or None where NumPy is to be used."""
        return self._ready.get(name)

    def want(self) -> None:
        """Have all lanes made ready in the background, once; returns at once."""
        with self._starting:
            if not self._automatic:
                return
            self._automatic = False
        # not a daemon: a compiler does not survive being frozen at exit
        threading.Thread(target=self._make_ready, name=THREAD).start()

    def compile_now(self) -> None:
        """Make all lanes ready before returning.

        Raises
        ------
        ImportError
            Where there is no compiler.
        """
        for name in COMPILED:
            import_module(f"transientcam_driver.simulation.{name}")
        from transientcam_driver.simulation.light.compiling import LANES as FOUND

        self._ready = dict(FOUND)

    def _make_ready(self) -> None:
        try:
            self.compile_now()
        except Exception as error:
            # whatever stops a compiler (a missing one, a full disk) must stop nothing else
            _log.info("moving light is computed by NumPy, as there is no compiler: %s", error)


# The one place that reads the environment; a process has one set of machine code.
LANES: Final = Lanes(os.environ)
