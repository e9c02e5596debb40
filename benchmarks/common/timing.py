"""Repeat something for a while, and say what it usually takes."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Seconds a call took, over all repetitions."""

    median_s: float
    low_s: float
    high_s: float
    best_s: float
    """``median_s``, ``low_s``, ``high_s``, ``best_s``: median, quartiles and minimum."""

    def __str__(self) -> str:
        """As in "1.23 ms ± 4 %": median, and half the distance of the quartiles."""
        spread = (self.high_s - self.low_s) / (2 * self.median_s)
        return f"{duration(self.median_s)} ± {100 * spread:.0f} %"


def duration(seconds: float) -> str:
    """Return a time with three digits and the unit that fits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def measure(call: Callable[[], object], *, least_s: float = 0.4, most: int = 400) -> Timing:
    """Call something once to warm up, then again and again for ``least_s``, and at least thrice."""
    call()
    taken: list[float] = []
    begin_s = time.perf_counter()
    while len(taken) < 3 or (time.perf_counter() - begin_s < least_s and len(taken) < most):
        start_s = time.perf_counter()
        call()
        taken.append(time.perf_counter() - start_s)
    if len(taken) == 3:
        low_s, high_s = min(taken), max(taken)
    else:
        low_s, _, high_s = statistics.quantiles(taken, n=4)
    return Timing(statistics.median(taken), low_s, high_s, min(taken))
