"""Compiled lanes beside this folder's arithmetic: the same bytes, used once they are ready.

A lane stands beside a statement in NumPy, which serves until a background thread has compiled it
or loaded it from the cache: no image waits for a compiler. Importing this module imports none. The
driver does not depend on numba; without it NumPy goes on serving.
"""

import logging
import os
import threading
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Final

THREAD: Final = "transientcam-compile-light"
"""Name of the thread that compiles."""
OF_IMAGES: Final = ("compiled_images",)
"""Modules of the lanes that images of any scene use."""
WORTH_PIXELS: Final = 100_000_000
"""Of images in NumPy, after which their lanes are asked for.

They save some 2 ns a pixel, and loading them takes 0.2 to 0.7 s of processor time.
"""
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
        self._starting, self._compiling = threading.Lock(), threading.Lock()
        self._wanted: set[str] = set()
        self._pixels = 0
        self._ready: dict[str, Callable[..., Any]] = {}

    def find(self, name: str) -> Callable[..., Any] | None:
        """Return a lane, or None where NumPy is to be used."""
        return self._ready.get(name)

    def want(self, modules: tuple[str, ...] = OF_IMAGES) -> None:
        """Have lanes made ready in the background, once; returns at once."""
        with self._starting:
            wanted = tuple(name for name in modules if name not in self._wanted)
            if not self._automatic or not wanted:
                return
            self._wanted.update(wanted)
        # not a daemon: a compiler does not survive being frozen at exit
        threading.Thread(target=self._make_ready, args=(wanted,), name=THREAD).start()

    def want_for_images(self, pixels: int) -> None:
        """Want lanes of images once NumPy has computed many; it has one more of so many pixels."""
        self._pixels += pixels
        if self._pixels >= WORTH_PIXELS:
            self.want(OF_IMAGES)

    def compile_now(self, modules: tuple[str, ...] = OF_IMAGES) -> None:
        """Make lanes ready before returning.

        Raises
        ------
        ImportError
            Where there is no compiler.
        """
        with self._compiling:  # so that lanes of a module become ready together
            for name in modules:
                import_module(f"transientcam_driver.simulation.{name}")
            from transientcam_driver.simulation.light.compiling import LANES as FOUND

            self._ready = dict(FOUND)

    def _make_ready(self, modules: tuple[str, ...]) -> None:
        try:
            self.compile_now(modules)
        except Exception as error:
            # whatever stops a compiler (a missing one, a full disk) must stop nothing else
            _log.info("the simulation is computed by NumPy, as there is no compiler: %s", error)


# The one place that reads the environment; a process has one set of machine code.
LANES: Final = Lanes(os.environ)
