"""Search: the quickest sequence that reaches a target, against brute force."""

import dataclasses
import math
from typing import cast

import pytest

from tests.server.planning.closed_form import MARGIN, ClosedForm, everything, planned, quickest_s
from transientcam_driver import Capabilities, Sequence
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal
from transientcam_server.planning._prediction.measures import Figure
from transientcam_server.planning._prediction.prediction import Prediction, Predictor
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.plan import plan


@pytest.mark.parametrize("target_m", [0.03, 0.008, 0.002])
def test_a_target_gets_the_quickest_sequence_that_reaches_it_with_margin(
    target_m: float, capabilities: Capabilities
) -> None:
    best = planned(Goal(range_error_m=target_m), capabilities).recommended

    reaching_s = [time_s for time_s, error_m in everything(capabilities) if error_m <= target_m]
    assert best.error_with_margin("range_error_m") <= target_m
    assert best.applied.capture_s == pytest.approx(min(reaching_s), rel=1e-6)


def test_half_the_time_will_do_where_the_rest_only_wears_noise_off_a_bias(
    capabilities: Capabilities,
) -> None:
    target_m = 0.735e-3  # the least bias of all is 0.694 mm, and 0.729 mm with the margin

    found = planned(Goal(range_error_m=target_m), capabilities)

    with_margin_s = min(
        time_s for time_s, error_m in everything(capabilities) if error_m <= target_m
    )
    error = found.recommended.predicted.range_error
    assert found.recommended.applied.capture_s <= with_margin_s / 4
    assert error.median <= target_m
    assert found.half_time is not None
    assert found.half_time.error("range_error_m") > target_m


def test_what_the_longest_capture_alone_reaches_is_found(capabilities: Capabilities) -> None:
    base = Sequence(harmonics=4)
    fixed = frozenset({"harmonics", "base_frequency_hz"})
    goal = Goal(base=base, fixed=fixed, estimator="likelihood", capture_s=1e9)
    (family,) = families(goal, cast(Predictor, ClosedForm()), capabilities)
    times_s = [member.capture_s for member in family.members]
    least_m = ClosedForm().least_noise_m("likelihood", family.first, family.members[-1].scale)

    best = planned(
        dataclasses.replace(goal, range_std_m=MARGIN * least_m * (1 + 1e-9)), capabilities
    ).recommended

    assert best.applied.capture_s == pytest.approx(times_s[-1])
    with pytest.raises(Problem):
        planned(dataclasses.replace(goal, range_std_m=MARGIN * least_m * 0.999), capabilities)


@pytest.mark.parametrize("budget_s", [0.03, 0.2])
def test_a_budget_gets_the_most_accurate_sequence_within_it(
    budget_s: float, capabilities: Capabilities
) -> None:
    best = planned(Goal(capture_s=budget_s), capabilities).recommended

    within = [error_m for time_s, error_m in everything(capabilities) if time_s <= budget_s]
    assert best.applied.capture_s <= budget_s
    assert best.error_with_margin("range_error_m") == pytest.approx(min(within), rel=1e-6)


def test_bias_rules_out_what_noise_alone_would_recommend(capabilities: Capabilities) -> None:
    noise = planned(Goal(range_std_m=0.005), capabilities).recommended
    both = planned(Goal(range_error_m=0.005), capabilities).recommended

    assert noise.predicted.range_bias_m > 0.005
    assert both.predicted.range_bias_m < 0.005
    assert noise.applied.capture_s < both.applied.capture_s


class Hasty(ClosedForm):
    """Few draws see a third of the error of one estimator, and the other's as it is."""

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m, bias_m, error_m = super().quick(estimator, sequence, scale)
        part = 1 / 3 if estimator == "maximum-entropy" else 1.0
        return std_m, bias_m, part * error_m

    def predict(
        self, estimator: str, sequence: Sequence, *, closely: bool = False, capture_s: float = 0.0
    ) -> Prediction:
        exact = super().quick(estimator, sequence, self.noise_scale(sequence))
        std, error = (Figure(each, each, each, each, each) for each in (exact[0], exact[2]))
        return Prediction(std, error, exact[1], exact[1], bias_known=True)


class Splitting(ClosedForm):
    """An estimator finds more returns the less noise there is, and errs the more for it."""

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m, bias_m, _ = super().quick(estimator, sequence, scale)
        bias_m *= 1 + 0.5 / scale if estimator == "likelihood" else 1
        return std_m, bias_m, math.hypot(std_m, bias_m)


@pytest.mark.parametrize("target_m", [0.02, 0.008, 0.003])
def test_what_few_draws_promised_in_vain_rules_out_no_quicker_family(
    target_m: float, capabilities: Capabilities
) -> None:
    predictor = Hasty()
    goal = Goal(range_error_m=target_m)

    found = plan(goal, cast(Predictor, predictor), capabilities, timed=lambda *_: 1e-3)

    expected_s = quickest_s(goal, predictor, capabilities)
    assert found.recommended.applied.capture_s == pytest.approx(expected_s)


@pytest.mark.parametrize("target_m", [0.02, 0.008, 0.005, 0.003])
def test_an_error_that_rises_again_with_time_hides_no_quicker_sequence(
    target_m: float, capabilities: Capabilities
) -> None:
    predictor = Splitting()
    goal = Goal(range_error_m=target_m, estimator="likelihood")

    found = plan(goal, cast(Predictor, predictor), capabilities, timed=lambda *_: 1e-3)

    expected_s = quickest_s(goal, predictor, capabilities)
    assert found.recommended.applied.capture_s == pytest.approx(expected_s)


class Sampled(ClosedForm):
    """Few pixels leave an error uncertain by a third; all that there are do not."""

    def predict(
        self, estimator: str, sequence: Sequence, *, closely: bool = False, capture_s: float = 0.0
    ) -> Prediction:
        found = super().predict(estimator, sequence)
        if closely:
            return found
        error = found.range_error
        uncertain = dataclasses.replace(error, with_margin=1.33 * error.median)
        return dataclasses.replace(found, range_error=uncertain)


@pytest.mark.parametrize("target_m", [0.02, 0.008, 0.005, 0.003])
def test_what_few_pixels_leave_undecided_is_decided_by_more(
    target_m: float, capabilities: Capabilities
) -> None:
    goal = Goal(range_error_m=target_m)

    found = plan(goal, cast(Predictor, Sampled()), capabilities, timed=lambda *_: 1e-3)

    expected_s = quickest_s(goal, ClosedForm(), capabilities)
    assert found.recommended.applied.capture_s == pytest.approx(expected_s)
    error = found.recommended.predicted.range_error
    assert error.with_margin == pytest.approx(MARGIN * error.median)


def test_no_exposure_saturates_and_no_range_is_ambiguous(capabilities: Capabilities) -> None:
    near = families(Goal(capture_s=1.0), cast(Predictor, ClosedForm()), capabilities)
    far = families(Goal(capture_s=1.0), cast(Predictor, ClosedForm(far_m=9.0)), capabilities)

    exposures_s = [member.exposure_s for family in near for member in family.members]
    assert max(exposures_s) <= 0.9 * 0.004 + 1e-9
    assert {family.first.base_frequency_hz for family in near} == {11.5e6, 23e6, 46e6, 69e6}
    assert {family.first.base_frequency_hz for family in far} == {11.5e6}
