"""What falls short of a goal, in words and as a document."""

import math

import pytest

from tests.server.planning.search.choices import choice
from transientcam_driver import Capabilities
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal
from transientcam_server.planning._search.search import Choice
from transientcam_server.planning._search.words import Shortfall, refusal


def refused(
    goal: Goal, field: str, best: Choice, *, together: bool = False, dearer: Choice | None = None
) -> Problem:
    return refusal(goal, Shortfall(field, best, together=together, dearer=dearer))


def test_noise_and_bias_are_named_by_which_is_larger(capabilities: Capabilities) -> None:
    goal = Goal(range_error_m=1e-3)
    biased = choice(capabilities, std_m=3e-3, bias_m=4e-3)
    noisy = choice(capabilities, std_m=4e-3, bias_m=3e-3, capture_s=0.125)
    even = choice(capabilities, std_m=4e-3, bias_m=4e-3, capture_s=0.125)

    found = refused(goal, "range_error_m", biased)
    assert found.detail == (
        "This cannot be reached on this scene: range_error_m = 0.001 in 90% of the pixels. The "
        "best range_error_m is 0.005. What limits it: more time does not help here: bias 4 mm at "
        "m = 3."
    )
    assert (found.extensions["field"], found.extensions["value"]) == ("range_error_m", 1e-3)
    assert found.extensions["limit"] == pytest.approx(5e-3)
    assert found.extensions["limited_by"] == "bias"
    assert found.extensions["best"] == biased.to_document()
    for each in (noisy, even):
        found = refused(goal, "range_error_m", each)
        assert found.extensions["limited_by"] == "noise"
        assert found.detail.endswith("noise 4 mm in 125 ms at m = 3.")
    # of the deviation alone no bias is at fault
    assert (
        refused(Goal(range_std_m=1e-3), "range_std_m", biased).extensions["limited_by"] == "noise"
    )


@pytest.mark.parametrize(("of_one_frame", "decided"), [(True, False), (False, True)])
def test_one_frame_of_another_purpose_decides_nothing(
    *, of_one_frame: bool, decided: bool, capabilities: Capabilities
) -> None:
    shortfall = Shortfall("range_error_m", choice(capabilities, std_m=3e-3, bias_m=4e-3))

    found = refusal(Goal(range_error_m=1e-3), shortfall, of_one_frame=of_one_frame)

    assert found.extensions["decided"] == decided
    assert ("cannot be reached" in found.detail) == decided
    assert ("a look at all frequencies may find less" in found.detail) != decided


@pytest.mark.parametrize(("limit_m", "margin"), [(4.9e-3, False), (5.0e-3, True), (6e-3, True)])
def test_a_target_that_is_reached_without_margin_is_said_to_be(
    limit_m: float, *, margin: bool, capabilities: Capabilities
) -> None:
    best = choice(capabilities, std_m=5e-3, bias_m=0.0)

    detail = refused(Goal(range_std_m=limit_m), "range_std_m", best).detail

    assert ("is 0.005, which leaves no margin." in detail) == margin


@pytest.mark.parametrize(("part", "named"), [(0.5, True), (0.79, True), (0.8, False), (1.0, False)])
def test_what_more_time_gives_is_named_where_it_is_clearly_less(
    part: float, *, named: bool, capabilities: Capabilities
) -> None:
    best = choice(capabilities, std_m=5e-3, bias_m=0.0, capture_s=0.1)
    dearer = choice(capabilities, std_m=part * 5e-3, bias_m=0.0, capture_s=0.25, harmonics=6)

    detail = refused(
        Goal(range_std_m=1e-3, capture_s=0.1), "range_std_m", best, dearer=dearer
    ).detail

    words = f"; m = 6 takes 2.5 x as long and is {5 * part:.3g} mm off."
    assert detail.endswith(words) == named


def test_other_targets_are_limited_by_the_longest_capture(capabilities: Capabilities) -> None:
    best = choice(capabilities, bound_width=1.5, separation_share=0.4)

    bounded = refused(Goal(bound_width=0.5), "bound_width", best)
    separate = refused(Goal(separation_m=0.3), "separation_m", best)

    assert (bounded.extensions["limit"], separate.extensions["limit"]) == (1.5, 0.4)
    assert "The best share of captures that find both is 0.4." in separate.detail
    for each in (bounded, separate):
        assert each.extensions["limited_by"] == "noise"
        assert each.detail.endswith("the longest capture there is does no better.")
        assert "margin" not in each.detail
    unknown = refused(Goal(separation_m=0.3), "separation_m", choice(capabilities))
    assert unknown.extensions["limit"] == 0.0


@pytest.mark.parametrize(
    ("goal", "field", "needed"),
    [
        (Goal(capture_s=0.01), "capture_s", 0.25),
        (Goal(frame_rate_hz=10.0), "frame_rate_hz", 4.0),
        (Goal(computing_share=0.1), "computing_share", 0.4),
    ],
)
def test_of_a_budget_what_is_needed_is_stated(
    goal: Goal, field: str, needed: float, capabilities: Capabilities
) -> None:
    best = choice(capabilities, capture_s=0.25, reconstruct_s=0.1)

    alone = refused(goal, field, best)
    together = refused(goal, field, best, together=True)

    assert alone.extensions["limit"] == together.extensions["limit"] == pytest.approx(needed)
    assert (alone.extensions["limited_by"], together.extensions["limited_by"]) == (
        "budget",
        "together",
    )
    assert alone.detail.endswith(f"{field} alone.")
    assert together.detail.endswith("the budgets together.")


def test_targets_may_be_out_of_reach_together(capabilities: Capabilities) -> None:
    found = refused(
        Goal(range_std_m=1e-3, bound_width=1.0), "range_std_m", choice(capabilities), together=True
    )

    assert found.detail.endswith("the targets together.")


def test_computing_time_that_is_unknown_is_beyond_all(capabilities: Capabilities) -> None:
    best = choice(capabilities, reconstruct_s=None)

    assert refused(Goal(computing_share=0.1), "computing_share", best).extensions["limit"] == (
        math.inf
    )
