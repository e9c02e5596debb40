"""A token bucket: so many events a second on average, and some at once."""

from collections.abc import Callable
from typing import Final

from transientcam.wire import MAX_CREDITS, MAX_SUBSCRIPTIONS

BURST_S: Final = 2.0
MOST_ANSWERS: Final = MAX_CREDITS * MAX_SUBSCRIPTIONS


class RateLimiter:
    """Counts what is done against what is allowed (a token bucket).

    ``rate_hz`` is allowed in the long run, and ``burst`` at once: what the rate gives in
    `BURST_S` where it is not given. What was sent to the client may be acknowledged, too: `credit`
    allows one more event, up to `MOST_ANSWERS` of them.
    """

    def __init__(
        self, rate_hz: float, *, clock: Callable[[], float], burst: float | None = None
    ) -> None:
        self._rate_hz = rate_hz
        self._clock = clock
        self._burst = BURST_S * rate_hz if burst is None else burst
        self._left = self._burst
        self._answers = 0
        self._counted_s = clock()

    @property
    def full(self) -> bool:
        """Whether as much is allowed as ever: nothing was counted for a while."""
        self._earn()
        return self._left >= self._burst

    def credit(self) -> None:
        """Allow one more."""
        self._answers = min(MOST_ANSWERS, self._answers + 1)

    def allow(self, count: int = 1) -> bool:
        """Count so many, and return whether they were allowed; what is refused is not counted."""
        answers = min(self._answers, count)
        rest = count - answers
        if rest:
            self._earn()
            if self._left < rest:
                return False
            self._left -= rest
        self._answers -= answers
        return True

    def _earn(self) -> None:
        now_s = self._clock()
        earned = self._rate_hz * (now_s - self._counted_s)
        self._counted_s = now_s
        self._left = min(self._burst, self._left + earned)
