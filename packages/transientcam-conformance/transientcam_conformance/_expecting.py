"""Assertions of checks: a promise was kept, or can be tried at all."""

from transientcam.errors import CheckSkipped, PromiseBroken


def expect(kept: object, what: str) -> None:
    """Raise `PromiseBroken` with ``what`` unless the promise was ``kept``."""
    if not kept:
        raise PromiseBroken(what)


def equal(found: object, expected: object, what: str) -> None:
    """Raise `PromiseBroken` unless ``found`` equals ``expected``; ``what`` names it."""
    if found != expected:
        raise PromiseBroken(f"{what} is {_shown(found)}, not {_shown(expected)}")


def skip_unless(possible: object, why: str) -> None:
    """Skip the check unless it is ``possible``."""
    if not possible:
        raise CheckSkipped(why)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 160 else text[:159] + "…"
