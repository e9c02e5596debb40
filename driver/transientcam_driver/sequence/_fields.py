"""Checks of the fields of a sequence: a `SequenceError` names the field, value and limit."""

import math
from collections.abc import Mapping
from numbers import Integral, Real

from transientcam_driver.errors import SequenceError


def known_keys(prefix: str, document: object, known: set[str] | frozenset[str]) -> None:
    """Refuse what is no JSON object, and a key that is not known."""
    if not isinstance(document, Mapping):
        raise SequenceError(prefix or "sequence", document, "an object")
    for key in document:
        if key not in known:
            name = f"{prefix}.{key}" if prefix else str(key)
            raise SequenceError(
                name, document[key], f"absent; known are {', '.join(sorted(known))}"
            )


def positive(name: str, value: object, limit: str) -> None:
    """Refuse what is no finite number above 0."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise SequenceError(name, value, limit)
    if not 0 < float(value) < math.inf:
        raise SequenceError(name, value, limit)


def integer(name: str, value: object, limit: str, *, least: int, most: int | None) -> None:
    """Refuse what is no integer from ``least`` to ``most``."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise SequenceError(name, value, limit)
    if not least <= int(value) <= (math.inf if most is None else most):
        raise SequenceError(name, value, limit)


def one_of(name: str, value: object, allowed: tuple[str, ...]) -> None:
    """Refuse what is none of the words allowed."""
    if not isinstance(value, str) or value not in allowed:
        raise SequenceError(name, value, f"one of {', '.join(allowed)}")
