"""Compiled kernels beside this folder's arithmetic: the same bytes, used once they are ready.

A kernel stands beside a statement in NumPy, which serves until the kernel is made ready in the
background: no image waits for a compiler. Importing this module imports none. The driver does not
depend on numba; without it NumPy goes on serving.
"""

import os
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, Final

from transientcam_compiled import Cache, Kernels

OF_IMAGES: Final = ("imaging._compiled_images",)
"""Modules of the kernels that images of any scene use."""
WORTH_PIXELS: Final = 100_000_000
"""Of images in NumPy, after which their kernels are asked for.

They save some 2 ns a pixel, and loading them takes 0.2 to 0.7 s of processor time.
"""
CHUNK: Final = 64
"""Points or pixels that kernels take at a time, which are mostly beside each other in a row."""
FUNCTIONS: Final[dict[str, dict[str, Callable[..., Any]]]] = {}
"""Those that each module has compiled, by their names."""
_PACKAGE: Final = "transientcam_simulation"
CACHE: Final = Cache(*(f"{_PACKAGE}.{room}" for room in ("compiled", "imaging", "light")))
"""Functions are shared between files: what is compiled is kept for one state of all of them."""


def _load(name: str) -> dict[str, Callable[..., Any]]:
    return FUNCTIONS[import_module(f"{_PACKAGE}.{name}").__name__]


class ImageKernels:
    """The compiled kernels of a process; ``TRANSIENTCAM_KERNELS`` as `Kernels` reads it.

    ``kernels``: the kernels of each module: they become ready together.
    """

    def __init__(self, environ: Mapping[str, str]) -> None:
        self.kernels = Kernels[str](environ, CACHE, _load, added=self._add)
        self._ready: dict[str, Callable[..., Any]] = {}
        self._pixels = 0

    def find(self, name: str) -> Callable[..., Any] | None:
        """Return a kernel, or None where NumPy is to be used."""
        return self._ready.get(name)

    def want(self, modules: tuple[str, ...] = OF_IMAGES) -> None:
        """Have kernels made ready in the background, once; returns at once."""
        for name in modules:
            self.kernels.want(name)

    def want_for_images(self, pixels: int) -> None:
        """Want kernels of images once NumPy has computed many; it adds one of so many pixels."""
        self._pixels += pixels
        if self._pixels >= WORTH_PIXELS:
            self.want(OF_IMAGES)

    def compile_now(self) -> None:
        """Make all kernels ready before returning."""
        for name in OF_IMAGES:
            self.kernels.make_ready(name)

    def _add(self, _module: str, functions: dict[str, Callable[..., Any]]) -> None:
        self._ready = {**self._ready, **functions}


# The one place that reads the environment; a process has one set of machine code.
IMAGE_KERNELS: Final = ImageKernels(os.environ)
