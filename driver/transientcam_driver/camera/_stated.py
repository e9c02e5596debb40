"""What the package of a camera states of it, checked field by field."""

import math
from dataclasses import is_dataclass
from numbers import Complex, Integral, Real
from types import UnionType
from typing import Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from transientcam_driver.errors import ProtocolError

LONGEST_SIDE: Final = 4096
_LONGEST: Final = 200
_WORDS: Final = {
    str: f"a printable text of at most {_LONGEST} characters",
    float: "a finite number",
    int: "a whole number",
}


def require(field: str, kept: object, limit: str, value: object) -> None:
    """Raise ProtocolError, which names field, value and limit, unless a condition is kept."""
    if not kept:
        raise ProtocolError(f"{field} is {value!r:.200}; allowed: {limit}")


def require_image(width: int, height: int, bits: int) -> None:
    """Refuse images that are empty, or larger than any camera's. Raises as `require`."""
    for name, side in (("width", width), ("height", height)):
        require(name, 1 <= side <= LONGEST_SIDE, f"1 to {LONGEST_SIDE} pixels", side)
    require("bits", 1 <= bits <= 16, "1 to 16", bits)


def finite(value: object) -> float | None:
    """Return a number of any type; None for what is none, and for NaN and infinity."""
    return float(value) if isinstance(value, Real) and math.isfinite(value) else None


def require_stated(stated: object, path: str = "") -> None:
    """Refuse a dataclass, and those in it, whose values are not of the types of their fields.

    Numbers are finite and texts can be shown. Raises ProtocolError as `require`.
    """
    for name, kind in get_type_hints(type(stated)).items():
        value = getattr(stated, name)
        require(path + name, _fits(value, kind), _WORDS.get(kind) or str(kind), value)
        several = isinstance(value, list | tuple)
        for at, each in enumerate(value if several else (value,)):
            if is_dataclass(each):
                require_stated(each, f"{path}{name}[{at}]." if several else f"{path}{name}.")


def _fits(value: Any, kind: Any) -> bool:
    of, given = get_origin(kind) or kind, get_args(kind)
    if of in (Union, UnionType):
        return any(_fits(value, each) for each in given)
    if of is Literal:
        return value in given
    if of is tuple:  # of any length
        return isinstance(value, list | tuple) and all(_fits(each, given[0]) for each in value)
    if kind is str:
        return isinstance(value, str) and len(value) <= _LONGEST and value.isprintable()
    if kind is float:
        return finite(value) is not None
    return isinstance(value, {int: Integral, complex: Complex}.get(of, of))
