"""One sequence and estimator with their predicted accuracy and cost."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from transientcam_driver import AppliedSequence, Sequence
from transientcam_server.planning._prediction.intervals import Figure
from transientcam_server.planning._prediction.measures import TOLERANCES_M
from transientcam_server.planning._prediction.prediction import Prediction


def in_words(sequence: Sequence, estimator: str) -> str:
    """State a sequence and an estimator: frequencies, exposure, takes."""
    takes = f" x {sequence.takes}" if sequence.takes > 1 else ""
    return (
        f"m = {sequence.harmonics} at {sequence.base_frequency_hz / 1e6:g} MHz, "
        f"{sequence.exposure_s * 1e3:.3g} ms{takes}, {estimator}"
    )


@dataclass(frozen=True, slots=True)
class Choice:
    """A sequence, an estimator, and their predicted accuracy and cost.

    ``applied``: As the camera would set it.
    ``estimator``: What its range is taken from.
    ``predicted``: Errors of the range.
    ``beyond_scene``: Whether it sees more than the look that describes the scene, so that the
    prediction is a lower bound of the error.
    ``timed``: Returns the computing time of one frame in s, measured on demand; None where its
    kernels are not compiled yet.
    ``bound_width``, ``separation_share``: Predicted where the goal has them.
    ``settling_s``: Part of the capture in which the modulation settles.
    ``share``, ``target_m``: Of the pixels, and the error that so many are to be within; None where
    the goal has none.
    """

    applied: AppliedSequence
    estimator: str
    predicted: Prediction
    beyond_scene: bool
    timed: Callable[[], float | None] = field(compare=False)
    bound_width: float | None = None
    separation_share: float | None = None
    settling_s: float = 0.0
    share: float | None = None
    target_m: float | None = None

    @property
    def range_error(self) -> Figure:
        """The error that a target limits: of the share of the goal, or of the median pixel."""
        return self.predicted.within or self.predicted.range_error

    @property
    def computing_share(self) -> float | None:
        """Share of a core's time between two frames that goes into reconstruction, if known."""
        reconstruct_s = self.timed()
        return None if reconstruct_s is None else reconstruct_s * self.applied.frame_rate_hz

    @property
    def price(self) -> dict[str, float | None]:
        """What a capture takes and leaves, item by item, as JSON; transport is told by frames."""
        applied, computing_s = self.applied, self.timed()
        light_s = applied.images * applied.sequence.exposure_s
        return {
            "light_s": light_s,
            "readout_s": applied.capture_s - light_s - self.settling_s,
            "settling_s": self.settling_s,
            "transport_s": None,
            "computing_s": computing_s,
            "sum_s": applied.capture_s + (computing_s or 0.0),
            "light_share": light_s / applied.capture_s,
            "data_bytes": round(applied.data_rate_bytes_s * applied.capture_s),
        }

    def error(self, target: str) -> float:
        """Return the error that a target limits, as it is expected."""
        if target == "bound_width":
            return math.inf if self.bound_width is None else self.bound_width
        if target == "separation_m":
            return 1.0 if self.separation_share is None else 1.0 - self.separation_share
        figure = self.predicted.range_std if target == "range_std_m" else self.range_error
        return figure.median

    def error_with_margin(self, target: str) -> float:
        """Return what most of the captures stay below."""
        if target == "range_error_m":
            return self.range_error.with_margin
        if target == "range_std_m":
            return self.predicted.range_std.with_margin
        return self.error(target)

    def relative_errors(self, targets: Mapping[str, float]) -> tuple[float, float]:
        """Return the worst error, and the worst with margin, over the largest that targets allow.

        Targets are reached where the latter is 1 at most.
        """
        error, with_margin = (
            max((of(name) / limit for name, limit in targets.items()), default=0.0)
            for of in (self.error, self.error_with_margin)
        )
        return error, with_margin

    def to_document(self) -> dict[str, Any]:
        """Return the choice as JSON; ``sequence`` is the body of a PUT."""
        document = self.applied.to_document()
        del document["sequence_id"]
        figure, target_m = self.predicted.within, self.target_m
        return {
            "sequence": self.applied.sequence.to_document(),
            "estimator": self.estimator,
            "applied": document,
            "capture_s": self.applied.capture_s,
            "frame_rate_hz": self.applied.frame_rate_hz,
            "reconstruct_s": self.timed(),
            "computing_share": self.computing_share,
            "price": self.price,
            "predicted": {
                "range_error_m": self.predicted.range_error.to_document(),
                "range_std_m": self.predicted.range_std.to_document(),
                "range_bias_m": self.predicted.range_bias_m,
                "range_bias_most_m": self.predicted.most_bias_m,
                "bias_known": self.predicted.bias_known,
                "within": figure
                and {
                    "share": self.share,
                    "error_m": figure.median,
                    **{end: figure.to_document()[end] for end in ("low", "high")},
                    "target_m": target_m,
                    "target_share": target_m and self.predicted.share_within(target_m),
                },
                "beyond": {
                    f"{each:g}": 1 - self.predicted.share_within(each)
                    for each in TOLERANCES_M
                    if self.predicted.off_m
                },
                "beyond_scene": self.beyond_scene,
                "bound_width": self.bound_width,
                "separation_share": self.separation_share,
            },
        }

    def in_words(self) -> str:
        """State the sequence and the estimator."""
        return in_words(self.applied.sequence, self.estimator)
