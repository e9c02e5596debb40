"""From a jitted function to a compiled entry that never compiles again."""

from collections.abc import Callable, Sequence
from typing import Any, get_type_hints

from numba import types as numba_types

from transientcam_moments._dispatch import CACHE
from transientcam_moments._kernels.arrays import Form
from transientcam_moments.arrays import Length

_types: Any = numba_types  # numba is only partly annotated
_ELEMENTS = {
    "f": {"real": "float32", "complex": "complex64"},
    "d": {"real": "float64", "complex": "complex128"},
}
_NUMBERS = {int: _types.int64, float: _types.float64, bool: _types.boolean}


def entry(
    function: Any, m: int, precision: str, **lengths: int | Sequence[int]
) -> Callable[..., Any]:
    """Compile ``function`` for what it is annotated with, or load it from the cache.

    Tuples are of length m, which is how a kernel learns m while it is compiled, but for those that
    are named in ``lengths``; of a tuple of tuples, the length of each.
    """
    hints = get_type_hints(function.py_func, include_extras=True)
    hints.pop("return")
    signature = [_type_of(hint, precision, lengths.get(name, m)) for name, hint in hints.items()]
    return CACHE.compile(function, tuple(signature))


def _type_of(hint: Any, precision: str, length: int | Sequence[int]) -> Any:
    if hint in _NUMBERS:
        return _NUMBERS[hint]
    if not isinstance(length, int):
        return _types.Tuple([_type_of(Length, precision, each) for each in length])
    if hint == Length:
        return _types.UniTuple(_types.int64, length)
    (form,) = (each for each in hint.__metadata__ if isinstance(each, Form))
    element = _ELEMENTS[precision].get(form.element, form.element)
    return _types.Array(getattr(_types, element), form.axes, "C")
