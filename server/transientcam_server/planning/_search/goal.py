"""The goal of a plan: targets of accuracy, budgets of time."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final

from transientcam_driver import Sequence
from transientcam_server.errors import Problem, kinds
from transientcam_server.planning._scene.region import Region

TARGETS: Final = ("range_error_m", "range_std_m", "separation_m", "bound_width")
"""Accuracies that a goal may limit; choices are compared by the first by default."""
SHARE: Final = 0.9
"""Of the pixels that are to be within a target; a capture has two of three within the error of the
median pixel."""
BUDGETS: Final = ("capture_s", "frame_rate_hz", "computing_share")


@dataclass(frozen=True, slots=True)
class Goal:
    """Targets and budgets of a sequence.

    ``range_error_m``: How far the range is off, noise and bias together, at most.
    ``share``: Of the pixels of a capture whose ranges are to be within it; None for the error of
    the median pixel, over many captures.
    ``region``: Whose lit pixels count; None for all of the picture.
    ``range_std_m``: Standard deviation of the range of a typical pixel, at most.
    ``separation_m``: Distance at which two equal returns are both to be found in `separation_share`
    of all captures.
    ``bound_width``: Width of the bounds on the density over the mean density, at most.
    ``capture_s``: Time of one capture, at most.
    ``frame_rate_hz``: Frames a second back to back, at least.
    ``computing_share``: Share of the time between two frames that reconstruction may take on this
    machine.
    ``base``: Sequence whose base frequency, half of it or a multiple, is used, and its sub-phases.
    ``fixed``: Names of further fields of it that must stay.
    ``estimator``: The only one that is planned with; None for any.
    """

    range_error_m: float | None = None
    share: float | None = SHARE
    region: Region | None = None
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
        return not self.targets and not self.budgets

    @property
    def leading(self) -> str:
        """The target that neighbours are compared by."""
        return next(iter(self.targets), TARGETS[0])

    @property
    def limits(self) -> dict[str, float]:
        """The largest error that each target allows."""
        limits = {name: float(getattr(self, name)) for name in self.targets}
        if "separation_m" in limits:
            limits["separation_m"] = 1.0 - self.separation_share
        return limits

    @property
    def targets(self) -> tuple[str, ...]:
        """The targets that are given."""
        return tuple(name for name in TARGETS if getattr(self, name) is not None)

    @property
    def budgets(self) -> tuple[str, ...]:
        """The budgets that are given."""
        return tuple(name for name in BUDGETS if getattr(self, name) is not None)

    def without_budgets(self) -> "Goal":
        """Return the goal of the same targets, whatever they cost."""
        return replace(self, capture_s=None, frame_rate_hz=None, computing_share=None)

    def affords(self, capture_s: float, computing_s: Callable[[], float | None]) -> bool:
        """Return whether captures of this length, back to back, are within the budgets.

        ``computing_s`` returns the computing time of a frame, if it is known; it is called where
        that is limited.
        """
        if self.capture_s is not None and capture_s > self.capture_s:
            return False
        if self.frame_rate_hz is not None and capture_s * self.frame_rate_hz > 1 + 1e-9:
            return False
        if self.computing_share is None:
            return True
        reconstruct_s = computing_s()
        return reconstruct_s is not None and reconstruct_s / capture_s <= self.computing_share

    def require_sensible(self) -> None:
        """Refuse a goal without target or budget, or with a value out of bounds.

        Raises Problem: ``invalid-request``.
        """
        if self.empty:
            raise Problem(
                kinds.INVALID_REQUEST,
                "Give a target or a budget.",
                field="target",
                value=None,
                limit=f"at least one of {', '.join((*TARGETS, *BUDGETS))}",
            )
        positive = [(name, math.inf, "a number above 0") for name in (*TARGETS, *BUDGETS)]
        shares = [(name, 1.0, "between 0 and 1") for name in ("share", "separation_share")]
        for name, most, limit in [*positive, *shares]:
            value = getattr(self, name)
            if value is not None and not 0 < value < most:
                detail = f"{name} = {value!r} must be {limit}."
                raise Problem(kinds.INVALID_REQUEST, detail, field=name, value=value, limit=limit)
