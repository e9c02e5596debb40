"""A check: a promise and the function that tries it."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from transientcam_conformance._device import Device


@dataclass(frozen=True, slots=True)
class Check:
    """One promise and the function that tries it."""

    group: str
    name: str
    """``group``, ``name``: its name in reports and on the command line."""
    promise: str
    """The sentence of the contract."""
    run: Callable[[Device], None]
    """Returns if the promise is kept; else raises `PromiseBroken`, or `CheckSkipped` if it cannot
    be tried."""


def checks(group: str, module: ModuleType) -> tuple[Check, ...]:
    """Return the public functions of a module as checks, in the order in which they stand.

    The name of one is its name, its docstring the promise.
    """
    return tuple(
        Check(group, name.replace("_", "-"), _sentence(each), each)
        for name, each in vars(module).items()
        if inspect.isfunction(each) and each.__module__ == module.__name__ and name[0] != "_"
    )


def _sentence(function: Callable[..., Any]) -> str:
    return " ".join((inspect.getdoc(function) or "").split())
