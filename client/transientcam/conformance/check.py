"""What a check is, and how it says that a promise was not kept."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from transientcam.errors import CheckSkipped, PromiseBroken

if TYPE_CHECKING:
    from transientcam.conformance.device import Device


@dataclass(frozen=True, slots=True)
class Check:
    """One promise and the function that tries it.

    Attributes
    ----------
    group, name
        What it is called in reports and on the command line.
    promise
        The sentence of the contract.
    run
        Returns where the promise is kept; else raises `PromiseBroken`, or `CheckSkipped` where it
        cannot be tried.
    """

    group: str
    name: str
    promise: str
    run: "Callable[[Device], None]"


def checks(group: str, *functions: "Callable[[Device], None]") -> tuple[Check, ...]:
    """Return functions as checks: the name of one is its name, its docstring the promise."""
    return tuple(
        Check(group, each.__name__.replace("_", "-"), _sentence(each), each) for each in functions
    )


def _sentence(function: Callable[..., Any]) -> str:
    return " ".join((inspect.getdoc(function) or "").split())


def expect(kept: object, what: str) -> None:
    """Say ``what`` is wrong unless a promise was ``kept``."""
    if not kept:
        raise PromiseBroken(what)


def equal(found: object, wanted: object, what: str) -> None:
    """Say what was ``found`` unless it is what was ``wanted``."""
    if found != wanted:
        raise PromiseBroken(f"{what} is {_shown(found)}, not {_shown(wanted)}")


def skip_unless(possible: object, why: str) -> None:
    """Leave the check out unless it is ``possible``."""
    if not possible:
        raise CheckSkipped(why)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 160 else text[:159] + "…"
