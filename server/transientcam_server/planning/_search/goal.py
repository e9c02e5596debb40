"""The goal of a plan: targets of accuracy, budgets of time."""

import math
from dataclasses import dataclass, field
from typing import Final

from transientcam_driver import Sequence
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._search.choice import TARGETS, Choice

BUDGETS: Final = ("capture_s", "frame_rate_hz", "computing_share")


@dataclass(frozen=True, slots=True)
class Goal:
    """Targets and budgets of a sequence.

    Attributes
    ----------
    range_error_m
        Noise and bias of the range together, of the median lit pixel, at most.
    range_std_m
        Standard deviation of the range of a typical pixel, at most.
    separation_m
        Distance at which two equal returns are both to be found in `separation_share` of all
        captures.
    bound_width
        Width of the bounds on the density over the mean density, at most.
    capture_s
        Time of one capture, at most.
    frame_rate_hz
        Frames a second back to back, at least.
    computing_share
        Share of the time between two frames that reconstruction may take on this machine.
    base
        Sequence whose base frequency, half of it or a multiple, is used, and its sub-phases.
    fixed
        Names of further fields of it that must stay.
    estimator
        The only one that is planned with; None for any.
    """

    range_error_m: float | None = None
    range_std_m: float | None = None
    separation_m: float | None = None
    separation_share: float = 0.9
    bound_width: float | None = None
    capture_s: float | None = None
    frame_rate_hz: float | None = None
    computing_share: float | None = None
    base: Sequence = field(default_factory=Sequence)
    fixed: frozenset[str] = frozenset()
    estimator: str | None = None

    @property
    def empty(self) -> bool:
        """Whether neither a target nor a budget is given."""
        return all(getattr(self, name) is None for name in (*TARGETS, *BUDGETS))

    @property
    def leading(self) -> str:
        """The target that neighbours are compared by."""
        return next((name for name in TARGETS if getattr(self, name) is not None), TARGETS[0])

    def limit(self, target: str) -> float:
        """Return the largest error that a target allows."""
        if target == "separation_m":
            return 1.0 - self.separation_share
        return float(getattr(self, target))

    @property
    def targets(self) -> tuple[str, ...]:
        """The targets that are given."""
        return tuple(name for name in TARGETS if getattr(self, name) is not None)

    def affords(self, choice: Choice) -> bool:
        """Return whether a choice is within the budgets."""
        return (
            self.affords_time(choice.applied.capture_s)
            and (self.frame_rate_hz is None or choice.applied.frame_rate_hz >= self.frame_rate_hz)
            and self.affords_computing(choice.computing_share)
        )

    def affords_computing(self, share: float | None) -> bool:
        """Return whether a share of a core's time is within the budget; not where it is unknown."""
        return self.computing_share is None or (share is not None and share <= self.computing_share)

    def affords_time(self, capture_s: float) -> bool:
        """Return whether captures of this length, back to back, are within the budgets."""
        return (self.capture_s is None or capture_s <= self.capture_s) and (
            self.frame_rate_hz is None or capture_s * self.frame_rate_hz <= 1 + 1e-9
        )

    def reached_by(self, choice: Choice) -> bool:
        """Return whether a choice reaches all targets, with the margin of its intervals."""
        return all(
            choice.error_with_margin(target) <= self.limit(target) for target in self.targets
        )

    def require_sensible(self) -> None:
        """Refuse a goal without target or budget, or with a value out of bounds.

        Raises
        ------
        Problem
            ``invalid-request``.
        """
        if self.empty:
            raise Problem(
                kinds.INVALID_REQUEST,
                "Give a target or a budget.",
                field="target",
                value=None,
                limit=f"at least one of {', '.join((*TARGETS, *BUDGETS))}",
            )
        for name in (*TARGETS, *BUDGETS):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise Problem(
                    kinds.INVALID_REQUEST,
                    f"{name} = {value!r} must be a number above 0.",
                    field=name,
                    value=value,
                    limit="a number above 0",
                )
        if not 0 < self.separation_share < 1:
            raise Problem(
                kinds.INVALID_REQUEST,
                f"separation_share = {self.separation_share!r} must be between 0 and 1.",
                field="separation_share",
                value=self.separation_share,
                limit="between 0 and 1",
            )
