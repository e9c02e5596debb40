"""From a jitted function to a compiled entry that never compiles again."""

from collections.abc import Callable, Iterable
from typing import Any

from numba import types as numba_types

from transientcam_moments._dispatch import CACHE

# numba is only partly annotated
_types: Any = numba_types

_REAL = {"f": _types.float32, "d": _types.float64}
_COMPLEX = {"f": _types.complex64, "d": _types.complex128}


def real_arrays(precision: str) -> dict[int, Any]:
    """Return the types of contiguous real arrays by their number of axes."""
    return {axes: _types.Array(_REAL[precision], axes, "C") for axes in (1, 2)}


def complex_arrays(precision: str) -> dict[int, Any]:
    """Return the types of contiguous complex arrays by their number of axes."""
    return {axes: _types.Array(_COMPLEX[precision], axes, "C") for axes in (1, 2)}


PIXELS = _types.int64
REAL = _types.float64
FLAG = _types.boolean
COUNTS = _types.Array(_types.int32, 1, "C")
PLACES = _types.Array(_types.int64, 1, "C")
TABLE = _types.Array(_types.int64, 2, "C")
BYTES = _types.Array(_types.uint8, 1, "C")
IMAGES = _types.Array(_types.uint16, 2, "C")


def order_type(m: int) -> Any:
    """Return the type of a tuple of length m: how a kernel learns m while it's compiled."""
    return _types.UniTuple(_types.int64, m)


def sizes_type(sizes: Iterable[int]) -> Any:
    """Return the type of a tuple of tuples of such lengths."""
    return _types.Tuple([order_type(size) for size in sizes])


def entry(function: Any, *signature: Any) -> Callable[..., Any]:
    """Compile ``function`` for one signature, or load it from the cache, and return its entry."""
    return CACHE.compile(function, signature)
