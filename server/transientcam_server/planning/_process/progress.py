"""How far a look or a plan has come; what it reports to may end it."""

from collections.abc import Callable
from typing import Any

Report = Callable[[float, str], None]
"""Takes the share that is done, 0 to 1, and the present step; what it raises ends the work."""
Show = Callable[[dict[str, Any]], None]
"""Takes what there is of the result so far, as JSON."""


class Progress:
    """Steps of work, reported by the work itself.

    ``report``: receives all that becomes known; called from the thread of the work.
    ``first``, ``last``: shares of the whole at which this work begins and ends.
    ``show``: receives the result as far as there is one; called from the thread of the work.
    """

    def __init__(
        self,
        report: Report = lambda share, step: None,
        *,
        first: float = 0.0,
        last: float = 1.0,
        show: Show = lambda document: None,
    ) -> None:
        self._report = report
        self.show = show
        self._first, self._last = first, last
        self._now = first, "waiting"

    def __call__(self) -> None:
        """Ask whether to go on, at the same step."""
        self._report(*self._now)

    def at(self, share: float, step: str) -> None:
        """Report the share of this work that is done, and what is next."""
        whole = self._first + (self._last - self._first) * min(share, 1.0)
        self._now = whole, step
        self._report(whole, step)

    def part(self, first: float, last: float, *, show: Show | None = None) -> "Progress":
        """Return the progress of work that is a part of this; ``show`` in the place of its own.

        What the part reports is where the whole is from then on, too.
        """
        span = self._last - self._first

        def report(share: float, step: str) -> None:
            self._now = share, step
            self._report(share, step)

        return Progress(
            report,
            first=self._first + span * first,
            last=self._first + span * last,
            show=show or self.show,
        )
