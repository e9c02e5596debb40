"""Plans: what they recommend, show, mark and refuse."""

import dataclasses
from typing import Any, cast

import numpy as np
import pytest

from tests.server.planning.closed_form import ClosedForm, planned
from transientcam_driver import Capabilities, Sequence
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal
from transientcam_server.planning._prediction.prediction import Prediction, Predictor
from transientcam_server.planning._search.plan import plan


class Doubtful(ClosedForm):
    """A look that does not tell the bias."""

    def __init__(self, dim_share: float, apart_m: float) -> None:
        super().__init__()
        apart = np.full_like(self.scene.direct_m, apart_m)
        self.scene = dataclasses.replace(self.scene, dim_share=dim_share, uncertainty_m=apart)

    def predict(
        self, estimator: str, sequence: Sequence, *, closely: bool = False, capture_s: float = 0.0
    ) -> Prediction:
        found = super().predict(estimator, sequence)
        return dataclasses.replace(found, most_bias_m=0.04, bias_known=False)


@pytest.mark.parametrize(
    ("dim_share", "apart_m", "reason"),
    [
        (0.0, 0.0, "put the range 40 mm off"),
        (0.0, 0.08, "later light differ by 80 mm"),
        (0.4, 0.08, "40% of the lit pixels"),
    ],
)
def test_a_bias_that_is_not_known_is_marked_with_the_reason(
    dim_share: float, apart_m: float, reason: str, capabilities: Capabilities
) -> None:
    predictor = cast(Predictor, Doubtful(dim_share, apart_m))
    found = plan(Goal(capture_s=0.1), predictor, capabilities, timed=lambda *_: 1e-3)
    assert "Bias unknown: " in found.summary
    assert reason in found.summary
    predicted = found.to_document()["predicted"]
    assert (predicted["bias_known"], predicted["range_bias_most_m"]) == (False, 0.04)
    assert "unknown" not in planned(Goal(capture_s=0.1), capabilities).summary


def test_a_plan_shows_what_it_recommends(capabilities: Capabilities) -> None:
    found = planned(Goal(range_error_m=0.02), capabilities)

    assert "mm noise, " in found.summary


def test_neighbours_take_half_the_time_and_have_half_the_error(capabilities: Capabilities) -> None:
    document = planned(Goal(range_error_m=0.0035), capabilities).to_document()

    assert document["half_time"]["time_factor"] <= 0.5
    assert document["half_time"]["error_factor"] > 1.0
    assert document["twice_accuracy"]["error_factor"] <= 0.5
    assert document["twice_accuracy"]["time_factor"] > 1.0


def test_what_the_camera_would_be_sent_is_what_was_predicted(capabilities: Capabilities) -> None:
    document = planned(Goal(range_error_m=1e-2), capabilities).to_document()

    applied = capabilities.apply(Sequence.from_document(document["sequence"]))

    assert applied.capture_s == pytest.approx(document["capture_s"], rel=1e-12)
    assert document["applied"]["images"] == applied.images


def test_fixed_fields_and_the_estimator_stay(capabilities: Capabilities) -> None:
    base = Sequence(harmonics=4, zeroth="on-off", takes=2)
    fixed = frozenset({"harmonics", "zeroth", "takes", "base_frequency_hz"})
    goal = Goal(capture_s=1.0, base=base, fixed=fixed, estimator="maximum-entropy")

    best = planned(goal, capabilities).recommended
    chosen = best.applied.sequence

    assert (chosen.harmonics, chosen.zeroth, chosen.takes) == (4, "on-off", 2)
    assert chosen.base_frequency_hz == 23e6
    assert best.estimator == "maximum-entropy"


def test_harmonics_that_are_fixed_are_kept_and_their_bias_is_reported(
    capabilities: Capabilities,
) -> None:
    goal = Goal(range_std_m=0.05, base=Sequence(harmonics=2), fixed=frozenset({"harmonics"}))

    document = planned(goal, capabilities).to_document()

    assert document["sequence"]["harmonics"] == 2
    assert document["predicted"]["range_bias_m"] > 1e-3


def test_bounds_and_separation_are_targets_too(capabilities: Capabilities) -> None:
    bounded = planned(Goal(bound_width=1.3), capabilities).recommended
    separating = planned(Goal(separation_m=0.5, separation_share=0.85), capabilities).recommended

    assert bounded.bound_width is not None
    assert bounded.bound_width <= 1.3
    assert bounded.applied.sequence.harmonics == 4
    assert bounded.applied.sequence.zeroth == "on-off"
    assert separating.separation_share is not None
    assert separating.separation_share >= 0.85


def test_a_range_beyond_all_frequencies_is_refused_as_ambiguous(capabilities: Capabilities) -> None:
    far = cast(Predictor, ClosedForm(far_m=20.0))

    with pytest.raises(Problem, match=r"unambiguous to 13\.0 m") as refusal:
        plan(Goal(capture_s=1.0), far, capabilities, timed=lambda *_: 1e-3)

    assert refusal.value.extensions["field"] == "base_frequency_hz"


@pytest.mark.parametrize(
    ("goal", "field", "limited_by"),
    [
        (Goal(range_error_m=1e-6), "range_error_m", "bias"),
        (Goal(range_std_m=1e-9), "range_std_m", "noise"),
        (Goal(bound_width=1e-3), "bound_width", "noise"),
        (Goal(separation_m=1e-3), "separation_m", "noise"),
        (Goal(capture_s=1e-3), "capture_s", "budget"),
        (Goal(frame_rate_hz=1e3), "frame_rate_hz", "budget"),
        (Goal(computing_share=1e-9), "computing_share", "budget"),
        (Goal(range_error_m=1e-4, capture_s=0.05), "range_error_m", "noise"),
    ],
)
def test_what_is_out_of_reach_is_refused_with_the_best_there_is_and_what_limits_it(
    goal: Goal, field: str, limited_by: str, capabilities: Capabilities
) -> None:
    with pytest.raises(Problem) as refusal:
        planned(goal, capabilities)

    problem = refusal.value
    assert problem.kind.slug == "target-unreachable"
    assert problem.kind.status == 409
    assert problem.extensions["field"] == field
    assert problem.extensions["limited_by"] == limited_by
    best = cast(dict[str, Any], problem.extensions["best"])
    again = capabilities.apply(Sequence.from_document(best["sequence"]))
    assert again.capture_s == pytest.approx(best["capture_s"])
    if goal.capture_s == 0.05:
        assert best["capture_s"] <= 0.05  # the best that the budget allows
        assert "x as long" in problem.detail


@pytest.mark.parametrize(
    "goal",
    [Goal(), Goal(range_error_m=-1.0), Goal(capture_s=float("nan")), Goal(separation_share=1.5)],
)
def test_a_goal_that_cannot_be_meant_is_refused(goal: Goal, capabilities: Capabilities) -> None:
    with pytest.raises(Problem) as refusal:
        planned(goal, capabilities)

    assert refusal.value.kind.slug == "invalid-request"
