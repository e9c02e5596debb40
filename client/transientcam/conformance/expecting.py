"""How a check says that a promise was not kept, or cannot be tried."""

from transientcam.errors import CheckSkipped, PromiseBroken


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
