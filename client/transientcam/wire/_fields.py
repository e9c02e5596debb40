"""Reading the fields of an untrusted map, one kind of value a function.

Each takes the map, the key and the path of the map within its message, and raises `ProtocolError`
naming all three of field, value and limit.
"""

import math
from collections.abc import Mapping
from typing import Any, TypeVar, cast

from transientcam.errors import ProtocolError

_T = TypeVar("_T")
_MISSING = "nothing"


def _value(document: Mapping[str, Any], key: str, kind: type[_T], path: str, limit: str) -> _T:
    value = document.get(key, _MISSING if key not in document else None)
    # bool is an int to isinstance, but never a count, an index or a rate here
    if (
        key not in document
        or not isinstance(value, kind)
        or (isinstance(value, bool) and kind is not bool)
    ):
        raise ProtocolError(join(path, key), value, limit)
    return value


def join(path: str, key: str) -> str:
    """Return the path of ``key`` in the map at ``path`` ('' for the message itself)."""
    return f"{path}.{key}" if path else key


def text(document: Mapping[str, Any], key: str, *, path: str = "", max_length: int = 256) -> str:
    """Read a string of at most ``max_length`` characters."""
    limit = f"a string of at most {max_length} characters"
    value = _value(document, key, str, path, limit)
    if len(value) > max_length:
        raise ProtocolError(join(path, key), value, limit)
    return value


def integer(
    document: Mapping[str, Any], key: str, *, minimum: int, maximum: int, path: str = ""
) -> int:
    """Read an integer from ``minimum`` to ``maximum``, both included."""
    limit = f"an integer from {minimum} to {maximum}"
    value = _value(document, key, int, path, limit)
    if not minimum <= value <= maximum:
        raise ProtocolError(join(path, key), value, limit)
    return value


def number(document: Mapping[str, Any], key: str, *, path: str = "") -> float:
    """Read a finite number."""
    limit = "a finite number"
    value = _value(document, key, cast("type[float]", (int, float)), path, limit)
    if not math.isfinite(value):
        raise ProtocolError(join(path, key), value, limit)
    return float(value)


def mapping(document: Mapping[str, Any], key: str, *, path: str = "") -> dict[str, Any]:
    """Read a map."""
    return cast("dict[str, Any]", _value(document, key, dict, path, "a map"))


def sequence(
    document: Mapping[str, Any], key: str, *, max_length: int, path: str = ""
) -> list[Any]:
    """Read a list of at most ``max_length`` items."""
    limit = f"a list of at most {max_length} items"
    value = _value(document, key, list, path, limit)
    if len(value) > max_length:
        raise ProtocolError(join(path, key), f"a list of {len(value)}", limit)
    return value


def strings(
    document: Mapping[str, Any], key: str, *, max_length: int, path: str = ""
) -> tuple[str, ...]:
    """Read a list of strings."""
    items = sequence(document, key, max_length=max_length, path=path)
    for index, item in enumerate(items):
        if not isinstance(item, str):
            raise ProtocolError(f"{join(path, key)}[{index}]", item, "a string")
    return tuple(items)


def integers(
    document: Mapping[str, Any], key: str, *, maximum: int, max_length: int, path: str = ""
) -> tuple[int, ...]:
    """Read a list of integers from 0 to ``maximum``."""
    items = sequence(document, key, max_length=max_length, path=path)
    for index, item in enumerate(items):
        if not isinstance(item, int) or isinstance(item, bool) or not 0 <= item <= maximum:
            raise ProtocolError(
                f"{join(path, key)}[{index}]", item, f"an integer from 0 to {maximum}"
            )
    return tuple(items)
