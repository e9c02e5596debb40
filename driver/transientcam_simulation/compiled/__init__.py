"""Compiling of what the simulated light computes pixel by pixel."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from transientcam_simulation.compiled._compiling import FLAG
from transientcam_simulation.compiled._image_kernels import CHUNK, IMAGE_KERNELS

if TYPE_CHECKING:
    from transientcam_simulation.compiled._compiling import (
        AROUND,
        CODES,
        DOUBLES,
        FLAGS,
        INDICES,
        LINE,
        MARKS,
        NUMBERS,
        PIXELS,
        PLACES,
        PLANE,
        PLANES,
        REGION,
        ROWS,
        STACK,
        TILES,
        WHOLE,
        float32,
        float64,
        inner,
        int32,
        int64,
        kernel,
    )

__all__ = [
    "AROUND",
    "CHUNK",
    "CODES",
    "DOUBLES",
    "FLAG",
    "FLAGS",
    "IMAGE_KERNELS",
    "INDICES",
    "LINE",
    "MARKS",
    "NUMBERS",
    "PIXELS",
    "PLACES",
    "PLANE",
    "PLANES",
    "REGION",
    "ROWS",
    "STACK",
    "TILES",
    "WHOLE",
    "float32",
    "float64",
    "inner",
    "int32",
    "int64",
    "kernel",
]


def __getattr__(name: str) -> Any:
    """Return what only compiled modules need, which imports numba."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}._compiling"), name)
