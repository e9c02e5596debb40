"""From functions to lanes: compiled for one signature by numba, or loaded from the cache."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import (
    float32 as numba_float32,
    float64 as numba_float64,
    int32 as numba_int32,
    int64 as numba_int64,
    njit,
    types as numba_types,
    uint16 as numba_uint16,
)

from transientcam_simulation.compiled._lanes import CACHE, FUNCTIONS

Function = TypeVar("Function", bound=Callable[..., Any])

# numba is only partly annotated
float32: Any = numba_float32
float64: Any = numba_float64
int32: Any = numba_int32
int64: Any = numba_int64
_types: Any = numba_types
LINE = float32[::1]
PLANE = _types.Array(float32, 2, "A")
WHOLE = _types.Array(float32, 2, "C")
DOUBLES = float64[::1]
ROWS = float64[:, ::1]
PLANES = float64[:, :, ::1]
STACK = _types.Array(float32, 3, "C")
TILES = _types.boolean[:, :, ::1]
MARKS = _types.boolean[:, ::1]
FLAGS = _types.boolean[::1]
FLAG = _types.boolean
PLACES = int64[::1]
CODES = _types.Array(numba_uint16, 1, "C")
NUMBERS = int64[:, ::1]
AROUND = int32[:, ::1]
PIXELS = int32[:, ::1]
"""Rows and columns."""
INDICES = int32[::1]
REGION = _types.UniTuple(int64, 4)
"""First row and column, numbers of rows and columns."""


def inner(function: Function) -> Function:
    """Have a function compiled into those that call it, which are in the same file.

    The cache notices changes of that file only. Calls that remain would count references of every
    array they pass, one by one between all cores: a fourth of the time of loops over short rows.
    """
    dispatcher: Any = njit(nogil=True, error_model="numpy", forceinline=True)(function)
    compiled: Function = dispatcher
    return compiled


def lane(*signature: Any) -> Callable[[Function], Function]:
    """Compile a function now, and for this signature only: no call starts the compiler."""

    def decorate(function: Function) -> Function:
        dispatcher: Any = njit(nogil=True, error_model="numpy")(function)
        CACHE.compile(dispatcher, signature)
        dispatcher.disable_compile()
        FUNCTIONS.setdefault(function.__module__, {})[function.__name__] = dispatcher
        compiled: Function = dispatcher
        return compiled

    return decorate
