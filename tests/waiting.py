"""Wait for what no event tells of, and leave the processor to those who bring it about."""

import time
from collections.abc import Callable

PATIENCE_S = 60.0
"""Until a test is taken to hang: a laden machine takes its time."""


def wait_until(condition: Callable[[], bool]) -> None:
    """Ask every 10 ms until it is so."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, "it did not happen"
        time.sleep(0.01)
