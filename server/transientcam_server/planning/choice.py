"""One sequence of the grid, with its predicted accuracy and cost."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from transientcam_driver import AppliedSequence
from transientcam_server.planning.pareto import front
from transientcam_server.planning.prediction import Deviation

TARGETS: Final = ("range_std_m", "separation_m", "bound_width")
"""Accuracies that a goal may limit; choices are compared by the first by default."""


@dataclass(frozen=True, slots=True)
class Choice:
    """A sequence and its predicted accuracy and cost.

    Attributes
    ----------
    applied
        As the camera would set it.
    reconstruct_s
        Computing time of one frame.
    range_std
        Predicted deviation of the range.
    range_bias_m
        How far the range of the median pixel is off without any noise.
    resolves
        Whether noise is what limits the range, and not returns that are taken for one.
    beyond_scene
        Whether it resolves more than the frame that describes the scene, so that the prediction
        is a lower bound of the error.
    range_std_interval
        Returns the 95 % interval of that of a typical pixel; computed on demand.
    bound_width, separation_share
        Predicted where the goal has them.
    """

    applied: AppliedSequence
    reconstruct_s: float
    range_std: Deviation
    range_bias_m: float
    resolves: bool
    beyond_scene: bool
    range_std_interval: Callable[[], tuple[float, float]] = field(compare=False)
    bound_width: float | None = None
    separation_share: float | None = None

    @property
    def computing_share(self) -> float:
        """Share of the time between two frames that goes into reconstruction."""
        return self.reconstruct_s * self.applied.frame_rate_hz

    def error(self, target: str) -> float:
        """Return the error that a target limits."""
        if target == "bound_width":
            return math.inf if self.bound_width is None else self.bound_width
        if target == "separation_m":
            return 1.0 if self.separation_share is None else 1.0 - self.separation_share
        return self.range_std.median_m

    def to_document(self) -> dict[str, Any]:
        """Return the choice as JSON; ``sequence`` is the body of a PUT."""
        document = self.applied.to_document()
        del document["sequence_id"]
        std = self.range_std
        low_m, high_m = self.range_std_interval()
        return {
            "sequence": self.applied.sequence.to_document(),
            "applied": document,
            "capture_s": self.applied.capture_s,
            "frame_rate_hz": self.applied.frame_rate_hz,
            "reconstruct_s": self.reconstruct_s,
            "computing_share": self.computing_share,
            "predicted": {
                "range_std_m": {
                    "median": std.median_m,
                    "low": low_m,
                    "high": high_m,
                    "p90": std.p90_m,
                },
                "range_bias_m": self.range_bias_m,
                "beyond_scene": self.beyond_scene,
                "first_order_share": std.first_order_share,
                "bound_width": self.bound_width,
                "separation_share": self.separation_share,
            },
        }


def choices_on_front(choices: list[Choice], leading: str = TARGETS[0]) -> list[Choice]:
    """Return those that no other beats in both time and accuracy."""
    return front(
        choices,
        cost=lambda choice: choice.applied.capture_s,
        error=lambda choice: choice.error(leading),
    )
