"""Goals: what they limit, what they afford and which of them make sense."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from transientcam_server.errors import Problem
from transientcam_server.planning import Goal


def never() -> float | None:
    raise AssertionError("computing time was asked for")


def computing(time_s: float | None) -> Callable[[], float | None]:
    return lambda: time_s


def test_a_goal_names_what_it_limits_and_leads_with_the_first() -> None:
    goal = Goal(bound_width=2.0, range_std_m=0.01, frame_rate_hz=5.0, capture_s=0.3)

    assert goal.targets == ("range_std_m", "bound_width")
    assert goal.budgets == ("capture_s", "frame_rate_hz")
    assert goal.leading == "range_std_m"
    assert goal.limits == {"range_std_m": 0.01, "bound_width": 2.0}
    assert Goal(capture_s=1.0).leading == "range_error_m"


def test_a_separation_allows_as_many_misses_as_its_share_leaves() -> None:
    assert Goal(separation_m=0.5, separation_share=0.75).limits == {"separation_m": 0.25}
    assert Goal(separation_m=0.5).limits["separation_m"] == pytest.approx(0.1)


@pytest.mark.parametrize("given", [{"range_std_m": 1.0}, {"capture_s": 1.0}])
def test_a_goal_of_anything_makes_sense(given: dict[str, Any]) -> None:
    Goal(**given).require_sensible()


def test_without_budgets_the_targets_stay() -> None:
    goal = Goal(range_std_m=0.01, capture_s=1.0, frame_rate_hz=2.0, computing_share=0.5)

    assert goal.without_budgets() == Goal(range_std_m=0.01)


@pytest.mark.parametrize(
    ("budgets", "capture_s", "affordable"),
    [
        ({}, 1e9, True),
        ({"capture_s": 0.5}, 0.5, True),
        ({"capture_s": 0.5}, 0.25, True),
        ({"capture_s": 0.5}, 0.5000001, False),
        ({"frame_rate_hz": 4.0}, 0.25, True),
        ({"frame_rate_hz": 10.0}, 0.1 * (1 + 1e-12), True),  # rounding of the rate
        ({"frame_rate_hz": 4.0}, 0.125, True),
        ({"frame_rate_hz": 4.0}, 0.2500001, False),
        ({"frame_rate_hz": 4.0, "capture_s": 1.0}, 0.5, False),
        ({"frame_rate_hz": 1.0, "capture_s": 0.25}, 0.5, False),
    ],
)
def test_captures_are_afforded_up_to_the_budget(
    budgets: dict[str, float], capture_s: float, *, affordable: bool
) -> None:
    assert Goal(**budgets).affords(capture_s, never) == affordable  # type: ignore[arg-type]  # fields by name


@pytest.mark.parametrize(
    ("reconstruct_s", "affordable"),
    [(0.25, True), (0.1, True), (0.2500001, False), (0.0, True), (None, False)],
)
def test_computing_may_take_its_share_of_a_capture_and_has_to_be_known(
    reconstruct_s: float | None, *, affordable: bool
) -> None:
    assert Goal(computing_share=0.5).affords(0.5, computing(reconstruct_s)) == affordable


@pytest.mark.parametrize("separation_share", [1e-9, 0.5, 1 - 1e-9])
@pytest.mark.parametrize("limit", [5e-324, 1.0, 1e300])
def test_any_positive_limit_makes_sense(limit: float, separation_share: float) -> None:
    Goal(range_error_m=limit, separation_share=separation_share).require_sensible()
    Goal(computing_share=limit).require_sensible()


@pytest.mark.parametrize(
    ("given", "field", "limit"),
    [
        ({}, "target", "at least one of range_error_m, "),
        ({"range_error_m": 0.0}, "range_error_m", "a number above 0"),
        ({"bound_width": -1.0}, "bound_width", "a number above 0"),
        ({"capture_s": math.inf}, "capture_s", "a number above 0"),
        ({"frame_rate_hz": math.nan}, "frame_rate_hz", "a number above 0"),
        ({"computing_share": 0.0}, "computing_share", "a number above 0"),
        ({"separation_m": 1.0, "separation_share": 0.0}, "separation_share", "between 0 and 1"),
        ({"separation_m": 1.0, "separation_share": 1.0}, "separation_share", "between 0 and 1"),
    ],
)
def test_a_goal_without_sense_is_refused_by_name(
    given: dict[str, Any], field: str, limit: str
) -> None:
    with pytest.raises(Problem) as caught:
        Goal(**given).require_sensible()

    assert caught.value.extensions["field"] == field
    assert str(caught.value.extensions["limit"]).startswith(limit)
    assert caught.value.kind.slug == "invalid-request"
