"""What is searched for a goal, family by family, against the lists that a plan states."""

import dataclasses
from typing import Any, cast

import pytest

from tests.server.planning.closed_form import ClosedForm, sequence_of
from transientcam_driver import Capabilities, Sequence
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._search.families import Family, families
from transientcam_server.planning._search.search import Candidate, curves, longest

BASE = Sequence(base_frequency_hz=20e6, harmonics=5, exposure_s=3e-3, takes=7)


class Light(ClosedForm):
    """A scene whose bright pixels saturate at an exposure."""

    def __init__(self, saturating_s: float) -> None:
        super().__init__()
        self.longest_exposure_s = saturating_s


def found(goal: Goal, capabilities: Capabilities, *, saturating_s: float = 0.004) -> list[Family]:
    return families(goal, cast(Predictor, Light(saturating_s)), capabilities)


def exposures_s(all_of_them: list[Family]) -> list[float]:
    return sorted({member.exposure_s for each in all_of_them for member in each.members})


def test_all_frequencies_harmonics_and_estimators_are_searched(capabilities: Capabilities) -> None:
    searched = {
        (each.estimator, each.first.harmonics, each.first.base_frequency_hz)
        for each in found(Goal(base=BASE, capture_s=1.0), capabilities)
    }

    frequencies_hz = (10e6, 20e6, 40e6, 60e6)
    harmonics = (2, 3, 4, 6, 8, 12)
    assert searched == {
        *(("single-frequency", 1, each) for each in frequencies_hz),
        *(
            (estimator, m, each)
            for estimator in ("maximum-entropy", "likelihood")
            for m in harmonics
            for each in frequencies_hz
            if m * each <= capabilities.max_frequency_hz
        ),
    }


def test_an_estimator_that_is_asked_for_is_searched_alone(capabilities: Capabilities) -> None:
    one = found(Goal(base=BASE, capture_s=1.0, estimator="pisarenko"), capabilities)

    assert {each.estimator for each in one} == {"pisarenko"}
    assert min(each.first.harmonics for each in one) >= 1
    single = found(Goal(base=BASE, capture_s=1.0, estimator="single-frequency"), capabilities)
    assert {each.first.harmonics for each in single} == {1}


@pytest.mark.parametrize(
    ("fixed", "values"),
    [("harmonics", {5}), ("base_frequency_hz", {20e6}), ("takes", {7}), ("exposure_s", {3e-3})],
)
def test_a_field_that_is_fixed_stays(
    fixed: str, values: set[Any], capabilities: Capabilities
) -> None:
    goal = Goal(base=BASE, capture_s=1.0, fixed=frozenset({fixed}))

    seen = {
        getattr(capabilities.apply(sequence_of(each, member)).sequence, fixed)
        for each in found(goal, capabilities)
        for member in each.members
    }

    assert seen == values


@pytest.mark.parametrize(
    ("goal", "zeroths"),
    [
        (Goal(base=BASE, capture_s=1.0), {"estimated"}),
        (Goal(base=BASE, bound_width=2.0), {"estimated", "on-off", "low-frequency"}),
        (
            Goal(
                base=dataclasses.replace(BASE, zeroth="on-off"),
                bound_width=2.0,
                fixed=frozenset({"zeroth"}),
            ),
            {"on-off"},
        ),
    ],
)
def test_how_the_zeroth_moment_is_measured_matters_to_bounds_alone(
    goal: Goal, zeroths: set[str], capabilities: Capabilities
) -> None:
    assert {each.first.zeroth for each in found(goal, capabilities)} == zeroths


def test_twenty_exposures_at_equal_ratios_are_tried(capabilities: Capabilities) -> None:
    tried_s = exposures_s(found(Goal(base=BASE, capture_s=1.0), capabilities, saturating_s=0.02))

    # up to 90 % of what saturates
    assert len(tried_s) == 20
    assert tried_s == pytest.approx([2e-4 * 90 ** (k / 19) for k in range(20)], abs=1e-9)


def test_a_camera_that_loses_images_takes_one_frequency_so_often_that_one_is_outvoted(
    capabilities: Capabilities,
) -> None:
    model = Light(0.004)

    def takes(lost_share: float, goal: Goal) -> set[int]:
        model.scene = dataclasses.replace(model.scene, lost_share=lost_share)
        searched = families(goal, cast(Predictor, model), capabilities)
        assert min(each.takes for of in searched if of.first.harmonics > 1 for each in of.members)
        return {each.takes for of in searched if of.first.harmonics == 1 for each in of.members}

    nine_in_ten = Goal(base=BASE, range_error_m=0.02, share=0.9)
    assert {1, 2} < takes(0.01, nine_in_ten)  # 4 of 100 captures of one take hold a lost image
    assert min(takes(0.07, nine_in_ten)) == 3  # 25 of 100
    assert min(takes(0.07, dataclasses.replace(nine_in_ten, share=0.7))) == 1
    fixed = dataclasses.replace(nine_in_ten, fixed=frozenset({"takes"}))
    assert takes(0.07, fixed) == {BASE.takes}


def test_exposures_are_those_that_the_camera_has(capabilities: Capabilities) -> None:
    bright = found(Goal(base=BASE, capture_s=1.0), capabilities, saturating_s=1e-4)
    dark = found(Goal(base=BASE, capture_s=1.0), capabilities, saturating_s=9.0)

    assert exposures_s(bright) == [9e-5]
    assert (exposures_s(dark)[0], exposures_s(dark)[-1]) == (2e-4, capabilities.max_exposure_s)
    # limits that are no whole number of nanoseconds, as of a duty cycle
    odd = dataclasses.replace(
        capabilities, min_exposure_s=1 / 30720, max_exposure_s=1 / 1536, exposure_step_s=1 / 30720
    )
    longest_s = exposures_s(found(Goal(base=BASE, capture_s=1.0), odd, saturating_s=9.0))[-1]
    assert longest_s == odd.max_exposure_s < round(longest_s, 9)
    slow = dataclasses.replace(capabilities, min_exposure_s=1e-3)
    assert exposures_s(found(Goal(base=BASE, capture_s=1.0), slow))[0] == 1e-3
    just = dataclasses.replace(capabilities, min_exposure_s=9e-5)
    assert exposures_s(found(Goal(capture_s=1.0), just, saturating_s=1.0001e-4)) == [9.0009e-5]
    with pytest.raises(Problem, match="saturates at more than 9e-05 s") as refusal:
        found(
            Goal(capture_s=1.0, fixed=frozenset({"takes", "harmonics"})),
            dataclasses.replace(capabilities, min_exposure_s=9.1e-5),
            saturating_s=1e-4,
        )
    assert refusal.value.extensions["field"] == "exposure_s"
    assert refusal.value.extensions["value"] == ["harmonics", "takes"]


def test_fixed_fields_that_no_camera_has_are_refused(capabilities: Capabilities) -> None:
    goal = Goal(
        base=dataclasses.replace(BASE, base_frequency_hz=140e6, harmonics=2),
        capture_s=1.0,
        fixed=frozenset({"base_frequency_hz", "harmonics"}),
    )

    with pytest.raises(Problem, match="the fixed fields exclude all"):
        found(goal, capabilities)


def test_members_take_the_time_that_the_camera_states_and_noise_falls_along_them(
    capabilities: Capabilities,
) -> None:
    settling = dataclasses.replace(capabilities, settle_s=1e-4)
    for family in found(Goal(base=BASE, capture_s=1.0), settling):
        times_s = [each.capture_s for each in family.members]
        scales = [each.scale for each in family.members]
        assert times_s == sorted(times_s)
        assert scales == sorted(scales, reverse=True)
        for member in family.members:
            applied = settling.apply(sequence_of(family, member))
            assert member.capture_s == pytest.approx(applied.capture_s, rel=1e-6)
            # in units of a capture of 1 ms and one take
            exposure_ms = applied.sequence.exposure_s * 1e3
            assert member.scale == pytest.approx((exposure_ms * member.takes) ** -0.5)


def test_families_begin_with_the_shortest_captures(capabilities: Capabilities) -> None:
    shortest_s = [
        each.members[0].capture_s for each in found(Goal(base=BASE, capture_s=1.0), capabilities)
    ]

    assert shortest_s == sorted(shortest_s)


@pytest.mark.parametrize(("most_takes", "most_images"), [(5, 2048), (256, 32), (256, 33)])
def test_no_more_takes_and_images_are_tried_than_the_camera_has(
    most_takes: int, most_images: int, capabilities: Capabilities
) -> None:
    small = dataclasses.replace(capabilities, max_takes=most_takes, max_images=most_images)

    for family in found(Goal(base=BASE, capture_s=1.0), small):
        images = family.first.images_per_take
        most = min(most_takes, most_images // images)
        tried = [each for each in (1, 2, 3, 4, 6, 8, 12, 16, 20) if each <= most]
        assert {each.takes for each in family.members} <= set(tried)
        assert max(each.takes for each in family.members) == max(tried)


@pytest.fixture
def curve(capabilities: Capabilities) -> tuple[Candidate, ...]:
    """Candidates of which the budgets allow the second to the fourth."""
    goal = Goal(base=BASE, capture_s=1.0)
    predictor = cast(Predictor, Light(0.004))
    found = families(goal, predictor, capabilities)
    whole = curves(found, goal, predictor, capabilities, lambda *_: 1e-3)[0]
    assert len(whole) > 5
    return tuple(
        dataclasses.replace(each, affordable=place in (1, 2, 3)) for place, each in enumerate(whole)
    )


@pytest.mark.parametrize(
    ("place", "more", "expected"),
    [
        (0, 0.0, None),
        (1, 0.0, 1),
        (1, -1e-9, None),
        (2, 0.0, 2),
        (2, 1e-9, 2),
        (3, -1e-9, 2),
        (4, 0.0, 3),
        (5, 1e9, 3),
    ],
)
def test_the_longest_candidate_is_within_the_budgets_and_the_time(
    place: int, more: float, expected: int | None, curve: tuple[Candidate, ...]
) -> None:
    assert longest(curve, curve[place].capture_s + more) == expected
    assert longest(curve) == 3


def test_only_errors_of_range_are_bounded_without_a_draw(curve: tuple[Candidate, ...]) -> None:
    one = curve[2]
    least_m = Light(0.004).least_noise_m(one.family.estimator, one.family.first, one.member.scale)

    assert one.least_error("range_std_m") == one.least_error("range_error_m") == least_m > 0
    assert one.least_error("bound_width") == one.least_error("separation_m") == 0.0
