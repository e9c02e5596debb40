"""Computing the light of a scene takes seconds; whoever waits for it may give it up."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final


def _go_on() -> None:
    """Give nothing up."""


_ASK: Final[ContextVar[Callable[[], object]]] = ContextVar("ask", default=_go_on)


@contextmanager
def giving_up_by(ask: Callable[[], object]) -> Iterator[None]:
    """Call ``ask`` between the steps of what this thread computes in the block.

    What it raises ends the computation, of which nothing is kept.
    """
    token = _ASK.set(ask)
    try:
        yield
    finally:
        _ASK.reset(token)


def ask() -> None:
    """Ask whether to go on; called between steps that take less than about a second each."""
    _ASK.get()()
