"""A token bucket: so many messages a second on average, and some at once."""

from collections.abc import Callable
from typing import Final

from transientcam.wire import MAX_CREDITS, MAX_SUBSCRIPTIONS

BURST_S: Final = 2.0
MOST_ANSWERS: Final = MAX_CREDITS * MAX_SUBSCRIPTIONS


class RateLimiter:
    """Counts what is done against what is allowed (a token bucket).

    ``rate_hz`` is allowed in the long run, and what that gives in `BURST_S` at once. What was
    sent to the client may be acknowledged, too: `credit` allows one more message, up to
    `MOST_ANSWERS` of them.
    """

    def __init__(self, rate_hz: float, *, clock: Callable[[], float]) -> None:
        self._rate_hz = rate_hz
        self._clock = clock
        self._left = BURST_S * rate_hz
        self._answers = 0
        self._counted_s = clock()

    def credit(self) -> None:
        """Allow one more."""
        self._answers = min(MOST_ANSWERS, self._answers + 1)

    def allow(self) -> bool:
        """Count one, and return whether it was allowed."""
        if self._answers:
            self._answers -= 1
            return True
        now_s = self._clock()
        earned = self._rate_hz * (now_s - self._counted_s)
        self._counted_s = now_s
        self._left = min(BURST_S * self._rate_hz, self._left + earned)
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
