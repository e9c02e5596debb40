"""A check: a promise and the function that tries it."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from transientcam_conformance._device import Device


@dataclass(frozen=True, slots=True)
class Check:
    """One promise and the function that tries it.

    Attributes
    ----------
    group, name
        Its name in reports and on the command line.
    promise
        The sentence of the contract.
    run
        Returns if the promise is kept; else raises `PromiseBroken`, or `CheckSkipped` if it cannot
        be tried.
    """

    group: str
    name: str
    promise: str
    run: Callable[[Device], None]


def checks(group: str, *functions: Callable[[Device], None]) -> tuple[Check, ...]:
    """Return functions as checks: the name of one is its name, its docstring the promise."""
    return tuple(
        Check(group, each.__name__.replace("_", "-"), _sentence(each), each) for each in functions
    )


def _sentence(function: Callable[..., Any]) -> str:
    return " ".join((inspect.getdoc(function) or "").split())
