"""Plans: the search against brute force, and what is predicted against what is then measured."""

import dataclasses
import json
import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from typing import Any, cast

import numpy as np
import pytest
import typer
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.accuracy.promises import measured
from transientcam_driver import (
    Camera,
    Capabilities,
    RawFrame,
    Sequence,
    SequenceError,
    open_camera,
)
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera.source import sensor_of
from transientcam_server.cli import plan as plan_verb
from transientcam_server.errors.exceptions import Problem
from transientcam_server.planning import (
    Goal,
    Plan,
    Planner,
    SceneStatistics,
    uniform_scene,
)
from transientcam_server.planning.families import EXPOSURES, HARMONICS, TAKES, families
from transientcam_server.planning.intervals import Figure
from transientcam_server.planning.look import FRAMES, STILL_FRAMES, STILL_SHARE
from transientcam_server.planning.measures import pixel_errors
from transientcam_server.planning.plan import plan
from transientcam_server.planning.prediction import Prediction, Predictor
from transientcam_server.planning.progress import Progress
from transientcam_server.planning.resolving import both_found
from transientcam_server.planning.sampling import one_of_each
from transientcam_server.planning.search import Search
from transientcam_server.planning.timing import ReconstructionTimer
from transientcam_server.settings import ReconstructionSettings, SensorSettings

Array = NDArray[Any]
SETTINGS = ReconstructionSettings()
FREQUENCY_HZ = 23e6


@pytest.fixture(scope="module")
def capabilities() -> Iterator[Capabilities]:
    with open_camera("sim:wall", clock=VirtualClock()) as opened:
        yield opened.capabilities


# -- the search ---------------------------------------------------------------------------------

SPREAD = 1.1
MARGIN = 1.05


class ClosedForm:
    """A predictor whose answers are formulas: noise by the light, bias by frequency and m."""

    def __init__(self, *, far_m: float = 2.0) -> None:
        self.scene = uniform_scene(1e6, [(far_m, 1.0)])

    def longest_exposure_s(self) -> float:
        return 0.004

    def noise_scale(self, sequence: Sequence) -> float:
        return float(np.sqrt(1e-3 / (sequence.exposure_s * sequence.takes)))

    def least_noise_m(self, estimator: str, sequence: Sequence, scale: float) -> float:
        m = 1 if estimator == "single-frequency" else sequence.harmonics
        return float(1e-2 * scale / m**1.5 / (sequence.base_frequency_hz / 23e6))

    def least_bias_m(self, estimator: str, sequence: Sequence) -> float:
        m = 1 if estimator == "single-frequency" else sequence.harmonics
        worse = {"single-frequency": 1.0, "maximum-entropy": 0.6, "likelihood": 0.5}[estimator]
        return 0.05 * worse / (m * sequence.base_frequency_hz / 23e6) ** 2

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m = self.least_noise_m(estimator, sequence, scale)
        bias_m = self.least_bias_m(estimator, sequence)
        return std_m, bias_m, math.hypot(std_m, bias_m)

    def predict(self, estimator: str, sequence: Sequence, *, closely: bool = False) -> Prediction:
        each = self.quick(estimator, sequence, self.noise_scale(sequence))
        std, bias, error = (
            Figure(value, value / SPREAD, value * SPREAD, 2 * value, value * MARGIN)
            for value in each
        )
        return Prediction(std, bias, error, 0.0, bias.median, bias_known=True)

    def beyond_scene(self, sequence: Sequence) -> bool:
        return False

    def bound_width(self, sequence: Sequence) -> float:
        return 6.0 / (sequence.harmonics + 1) + (0.5 if sequence.zeroth == "estimated" else 0.0)

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        return 1.0 - float(0.5 ** (sequence.harmonics * distance_m))


def planned(goal: Goal, capabilities: Capabilities) -> Plan:
    return plan(goal, cast(Predictor, ClosedForm()), capabilities, timed=lambda *_: 1e-3)


@lru_cache(maxsize=1)
def everything(capabilities: Capabilities) -> list[tuple[float, float]]:
    """Time and error, with margin, of all the grid, one by one: brute force."""
    found = []
    model = ClosedForm()
    exposures_s = np.geomspace(2e-4, 0.9 * 0.004, EXPOSURES)
    for factor in (0.5, 1.0, 2.0, 3.0):
        for m in HARMONICS:
            for estimator in ("single-frequency", "maximum-entropy", "likelihood"):
                if (m == 1) != (estimator == "single-frequency"):
                    continue
                for exposure_s in exposures_s:
                    for takes in TAKES:
                        wanted = Sequence(
                            factor * 23e6, m, "estimated", round(exposure_s, 9), takes
                        )
                        try:
                            applied = capabilities.apply(wanted)
                        except SequenceError:
                            continue
                        figure = model.predict(estimator, applied.sequence).range_error
                        found.append((applied.capture_s, figure.with_margin))
    return found


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

    assert noise.predicted.range_bias.median > 0.005
    assert both.predicted.range_bias.median < 0.005
    assert noise.applied.capture_s < both.applied.capture_s


class Doubtful(ClosedForm):
    """A look that does not tell the bias."""

    def __init__(self, dim_share: float, apart_m: float) -> None:
        super().__init__()
        apart = np.full_like(self.scene.direct_m, apart_m)
        self.scene = dataclasses.replace(self.scene, dim_share=dim_share, uncertainty_m=apart)

    def predict(self, estimator: str, sequence: Sequence, *, closely: bool = False) -> Prediction:
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


@pytest.mark.parametrize(("apart_m", "known"), [(0.0, True), (0.0005, True), (0.02, False)])
def test_a_bias_is_not_known_where_the_estimators_of_a_look_disagree(
    apart_m: float, known: bool
) -> None:
    one = uniform_scene(4e5, [(2.0, 1.0)])
    scene = dataclasses.replace(one, uncertainty_m=np.full_like(one.direct_m, apart_m))

    found = Predictor(scene, tm.noise.Sensor(), SETTINGS).predict(
        "likelihood", Sequence(harmonics=3)
    )

    assert found.range_error.median > apart_m
    assert found.bias_known is known


class Hasty(ClosedForm):
    """Few draws see a third of the error of one estimator, and the other's as it is."""

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m, bias_m, error_m = super().quick(estimator, sequence, scale)
        part = 1 / 3 if estimator == "maximum-entropy" else 1.0
        return std_m, bias_m, part * error_m

    def predict(self, estimator: str, sequence: Sequence, *, closely: bool = False) -> Prediction:
        exact = super().quick(estimator, sequence, self.noise_scale(sequence))
        std, bias, error = (Figure(each, each, each, each, each) for each in exact)
        return Prediction(std, bias, error, 0.0, bias.median, bias_known=True)


class Splitting(ClosedForm):
    """An estimator finds more returns the less noise there is, and errs the more for it."""

    def quick(self, estimator: str, sequence: Sequence, scale: float) -> tuple[float, float, float]:
        std_m, bias_m, _ = super().quick(estimator, sequence, scale)
        bias_m *= 1 + 0.5 / scale if estimator == "likelihood" else 1
        return std_m, bias_m, math.hypot(std_m, bias_m)


def quickest_s(goal: Goal, predictor: ClosedForm, capabilities: Capabilities) -> float:
    """Time of the quickest that reaches a target, by trying all."""
    like = cast(Predictor, predictor)
    assert goal.range_error_m is not None
    return min(
        member.capture_s
        for family in families(goal, like, capabilities)
        for member in family.members
        if like.predict(family.estimator, family.applied(member).sequence).range_error.with_margin
        <= goal.range_error_m
    )


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

    def predict(self, estimator: str, sequence: Sequence, *, closely: bool = False) -> Prediction:
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


def test_a_plan_shows_what_it_recommends(capabilities: Capabilities) -> None:
    found = planned(Goal(range_error_m=0.02), capabilities)

    sequence = found.recommended.applied.sequence
    assert repr(found).startswith(f"<Plan m = {sequence.harmonics} at ")
    assert found.recommended.estimator in repr(found)
    assert "bias)" in repr(found)
    assert "<th>half the time</th>" in found._repr_html_()
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


def test_no_exposure_saturates_and_no_range_is_ambiguous(capabilities: Capabilities) -> None:
    near = families(Goal(capture_s=1.0), cast(Predictor, ClosedForm()), capabilities)
    far = families(Goal(capture_s=1.0), cast(Predictor, ClosedForm(far_m=9.0)), capabilities)

    exposures_s = [member.exposure_s for family in near for member in family.members]
    assert max(exposures_s) <= 0.9 * 0.004 + 1e-9
    assert {family.first.base_frequency_hz for family in near} == {11.5e6, 23e6, 46e6, 69e6}
    assert {family.first.base_frequency_hz for family in far} == {11.5e6}


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
        (Goal(range_error_m=1e-4, capture_s=0.06), "range_error_m", "noise"),
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
    if goal.capture_s == 0.06:
        assert best["capture_s"] <= 0.06  # the best that the budget allows
        assert "x as long" in problem.detail


@pytest.mark.parametrize(
    "goal",
    [Goal(), Goal(range_error_m=-1.0), Goal(capture_s=float("nan")), Goal(separation_share=1.5)],
)
def test_a_goal_that_cannot_be_meant_is_refused(goal: Goal, capabilities: Capabilities) -> None:
    with pytest.raises(Problem) as refusal:
        planned(goal, capabilities)

    assert refusal.value.kind.slug == "invalid-request"


def test_the_whole_is_where_its_part_is() -> None:
    reports: list[tuple[float, str]] = []
    whole = Progress(lambda share, step: reports.append((share, step)))

    whole.part(0.5, 1.0).part(0.0, 0.8).at(0.5, "searching")
    whole()

    assert [step for _, step in reports] == ["searching", "searching"]
    assert [share for share, _ in reports] == pytest.approx([0.7, 0.7])


def test_lines_fall_onto_the_bias(capabilities: Capabilities) -> None:
    predictor = cast(Predictor, ClosedForm())
    goal = Goal()
    search = Search(goal, families(goal, predictor, capabilities), predictor, lambda *_: 1e-3)

    shares: list[float] = []
    progress = Progress(lambda share, step: shares.append(share))
    *so_far, front = search.fronts("range_error_m", progress)
    ends = front[0].applied.capture_s, front[-1].applied.capture_s
    for part in so_far[1:]:
        times_s = [choice.applied.capture_s for choice in part]
        assert times_s == sorted(times_s)
        assert (times_s[0], times_s[-1]) == ends, "both ends first, then what is between"
    assert [len(part) for part in so_far] == sorted(len(part) for part in so_far)
    lines = search.lines(front)

    assert shares == sorted(set(shares))
    assert (shares[0], len(shares)) == (0.0, 12)

    times_s = [choice.applied.capture_s for choice in front]
    assert len(front) > 3
    assert times_s == sorted(times_s)
    for line in lines:
        noise_m = [point.range_std_m for point in line.points]
        assert noise_m == sorted(noise_m, reverse=True)
        assert len({point.range_bias_m for point in line.points}) == 1
        assert all(
            point.range_error_m == math.hypot(point.range_std_m, point.range_bias_m)
            for point in line.points
        )


# -- measures -----------------------------------------------------------------------------------


def test_errors_of_drawn_ranges_are_their_deviation_and_their_bias() -> None:
    random = np.random.default_rng(1)
    true_m = np.linspace(1.0, 2.0, 500)
    range_m = true_m + 0.02 + 0.003 * random.standard_normal((40, 500))

    errors = pixel_errors(range_m, true_m)

    assert np.median(errors.std_m) == pytest.approx(0.003, rel=0.05)
    assert np.median(errors.bias_m) == pytest.approx(0.02, rel=0.05)
    assert np.median(errors.error_m) == pytest.approx(math.hypot(0.003, 0.02), rel=0.05)
    assert errors.outlier_share == 0.0


def test_strays_and_missing_ranges_are_outliers_and_leave_the_median_pixel_alone() -> None:
    random = np.random.default_rng(2)
    range_m = 1.0 + 0.003 * random.standard_normal((20, 100))
    range_m[::20] += 1.0  # 5 % of the captures
    range_m[:, :5] = np.nan

    errors = pixel_errors(range_m, np.ones(100))

    assert np.median(errors.error_m) == pytest.approx(0.003, rel=0.35)
    assert errors.outlier_share == pytest.approx(0.05 + 0.95 * 0.05, abs=0.01)
    assert np.isinf(errors.error_m[:5]).all()


# -- scenes -------------------------------------------------------------------------------------


def test_a_given_scene_has_the_moments_of_its_returns() -> None:
    scene = uniform_scene(1e6, [(1.5, 3.0), (3.0, 1.0)])
    period_m = tm.SPEED_OF_LIGHT_M_S / (2 * FREQUENCY_HZ)

    b = scene.relative_moments(2, FREQUENCY_HZ)

    expected = 0.75 * np.exp(4j * np.pi * 1.5 / period_m) + 0.25 * np.exp(
        4j * np.pi * 3.0 / period_m
    )
    assert b[0, 0] == pytest.approx(1.0)
    assert b[2, 0] == pytest.approx(expected)
    np.testing.assert_allclose(scene.direct_m, 1.5)
    assert scene.ambiguous(2.0)
    assert not scene.ambiguous(3.5)


def test_both_returns_count_as_found_only_near_their_places() -> None:
    phase = np.array([[1.0, 1.0, 1.0], [2.0, 1.6, 2.0]])
    weight = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 0.05]])
    returns = tm.Returns(phase, weight, np.zeros(3), np.full(3, 2))

    found = both_found(returns, np.array([1.0, 2.0]), threshold=0.1)

    np.testing.assert_array_equal(found, [True, False, False])


# -- looks --------------------------------------------------------------------------------------


def looked(spec: str) -> tuple[Planner, SceneStatistics]:
    clock = VirtualClock()
    with open_camera(spec, clock=clock) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        return planner, planner.look(camera, Sequence())


@pytest.fixture(scope="module")
def wall() -> tuple[Planner, SceneStatistics]:
    return looked("sim:wall?seed=7")


SCENE = """
name = "stage"
description = "A panel before nothing"
seed = 3
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 2.0, 0.0]
field_of_view_deg = 40.0
[light]
position_m = [0.05, 0.0, 0.0]
aim_at_m = [0.0, 2.0, 0.0]
electrons_per_s = {light}
[ambient]
electrons_per_s = {ambient}
[[surface]]
name = "panel"
kind = "diffuse"
centre_m = [0.0, {away_m}, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [{width_m}, {width_m}]
albedo = 0.8
"""


def test_a_look_knows_the_range_beyond_the_unambiguous_one_and_the_light_of_the_sun(
    tmp_path: Any,
) -> None:
    path = tmp_path / "far.toml"
    path.write_text(SCENE.format(light=4e8, ambient=6e6, away_m=9.0, width_m=9.0))

    planner, scene = looked(f"sim:{path}?seed=7")

    assert np.median(scene.direct_m) == pytest.approx(9.0, abs=0.3)
    assert np.median(scene.ambient_dn_per_s) == pytest.approx(0.8 * 6e6 / 9.0, rel=0.5)
    assert scene.ambiguity_checked
    best = planner.plan(Goal(capture_s=0.1), scene).recommended
    assert best.applied.unambiguous_range_m > 9.0


def test_a_look_counts_lit_pixels_alone(tmp_path: Any) -> None:
    path = tmp_path / "panel.toml"
    path.write_text(SCENE.format(light=5e7, ambient=0.0, away_m=2.0, width_m=0.6))

    _, scene = looked(f"sim:{path}?seed=7")

    with open_camera(f"sim:{path}", clock=VirtualClock()) as camera:
        assert camera.simulation is not None
        lit_share = np.isfinite(camera.simulation.truth().range_m).mean()
    assert scene.lit_share == pytest.approx(lit_share, rel=0.02)


def test_a_dark_scene_is_refused(tmp_path: Any) -> None:
    path = tmp_path / "dark.toml"
    path.write_text(SCENE.format(light=1.0, ambient=0.0, away_m=2.0, width_m=3.0))

    with pytest.raises(Problem, match="No pixel has light"):
        looked(f"sim:{path}?seed=7")


def test_a_look_can_be_ended() -> None:
    class EnoughError(Exception):
        pass

    shares = []

    def report(share: float, step: str) -> None:
        shares.append(share)
        if step == "all frequencies":
            raise EnoughError

    with open_camera("sim:wall", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        with pytest.raises(EnoughError):
            planner.look(camera, Sequence(), progress=Progress(report))

    assert shares == sorted(shares)
    assert 0 < shares[-1] < 0.5


class Carried:
    """A camera that is turned by so many pixels from frame to frame."""

    def __init__(self, camera: Camera, pixels: int) -> None:
        self.capabilities = camera.capabilities
        self.configure, self.start, self.stop = camera.configure, camera.start, camera.stop
        self._camera, self._pixels, self._read = camera, pixels, 0

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        raw = self._camera.read_frame(timeout_s=timeout_s)
        self._read += 1
        images = np.roll(np.asarray(raw.images), self._pixels * self._read, axis=2)
        return dataclasses.replace(raw, images=images)


@pytest.mark.parametrize(("pixels", "frames"), [(0, STILL_FRAMES), (2, FRAMES)])
def test_only_what_stands_still_is_looked_at_for_long(
    pixels: int, frames: int, tmp_path: Any
) -> None:
    path = tmp_path / "panel.toml"
    path.write_text(SCENE.format(light=5e7, ambient=0.0, away_m=2.0, width_m=0.6))
    steps = []

    with open_camera(f"sim:{path}?seed=7", clock=VirtualClock()) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        scene = planner.look(
            Carried(camera, pixels),
            Sequence(),
            progress=Progress(lambda share, step: steps.append(step)),
        )

    assert steps.count("all frequencies") == frames
    assert (scene.moving_share > STILL_SHARE) == (frames == FRAMES)


# -- prediction ---------------------------------------------------------------------------------


def test_deviation_of_one_return_at_one_frequency_is_the_closed_form() -> None:
    sensor = tm.noise.Sensor()
    predictor = Predictor(uniform_scene(4e5, [(2.0, 1.0)]), sensor, SETTINGS)
    sequence = Sequence(harmonics=1, exposure_s=0.001, takes=2, zeroth="estimated")

    predicted = predictor.predict("single-frequency", sequence)

    b0, gain = (
        400.0,
        abs(tm.nominal_calibration(1, sequence.sub_phases.phases_rad, zeroth="on-off")[1]),
    )
    variance = (b0 / 9.0 + 2 * (30 / 9.0) ** 2 + 1 / 6) / gain**2 / 2
    std_rad = np.sqrt(variance * tm.noise.smoothing_factor(0.6)) / b0
    expected_m = tm.range_m(std_rad, FREQUENCY_HZ)
    assert predicted.range_std.median == pytest.approx(expected_m, rel=0.05)
    # the median over 30 draws is itself that noisy
    assert predicted.range_bias.median < 0.25 * expected_m
    assert predictor.least_noise_m(
        "single-frequency", sequence, predictor.noise_scale(sequence)
    ) == pytest.approx(expected_m, rel=1e-3)


def test_more_pixels_know_an_error_more_closely() -> None:
    """Each has a second return of its own."""
    one = uniform_scene(1e6, [(2.0, 1.0)])
    random = np.random.default_rng(4)
    pixels = 1024
    full: dict[str, Any] = {
        each.name: np.repeat(value, pixels // value.shape[-1], axis=-1)
        for each in dataclasses.fields(one)
        if isinstance(value := getattr(one, each.name), np.ndarray)
    }
    delay_s = 2 * random.uniform(2.2, 4.0, (1, pixels)) / tm.SPEED_OF_LIGHT_M_S
    share = np.linspace(0, 0.5, pixels)[None]
    scene = dataclasses.replace(
        one,
        **full
        | {
            "delay_s": np.concatenate([full["delay_s"], delay_s]),
            "share": np.concatenate([full["share"] - share, share]),
        },
    )
    predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS)
    sequence = Sequence(harmonics=1, exposure_s=0.002, takes=100, zeroth="estimated")

    few = predictor.predict("single-frequency", sequence).range_error
    many = predictor.predict("single-frequency", sequence, closely=True).range_error

    turn = 4 * np.pi * sequence.base_frequency_hz / tm.SPEED_OF_LIGHT_M_S
    mixed = (1 - share) * np.exp(2j * turn) + share * np.exp(
        1j * turn * delay_s * tm.SPEED_OF_LIGHT_M_S / 2
    )
    bias_m = np.abs(np.remainder(np.angle(mixed) / turn - 2.0 + np.pi, 2 * np.pi) - np.pi)
    assert many.median == pytest.approx(np.median(bias_m), rel=0.02)
    assert few.median == pytest.approx(np.median(bias_m[:, one_of_each(pixels)]), rel=0.02)
    assert few.median != pytest.approx(np.median(bias_m), rel=0.1)


def test_the_bias_of_a_second_return_is_that_of_the_phase_of_the_sum() -> None:
    scene = uniform_scene(1e6, [(1.5, 3.0), (2.5, 1.0)])
    predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS)
    sequence = Sequence(harmonics=1, exposure_s=0.002, takes=100, zeroth="estimated")

    predicted = predictor.predict("single-frequency", sequence)

    period_m = tm.SPEED_OF_LIGHT_M_S / (2 * FREQUENCY_HZ)
    turn = 2 * np.pi / period_m
    mixed = np.angle(3 * np.exp(1j * turn * 1.5) + np.exp(1j * turn * 2.5)) / turn
    assert predicted.range_bias.median == pytest.approx(mixed - 1.5, rel=0.01)
    assert predicted.range_error.median == pytest.approx(mixed - 1.5, rel=0.01)


@pytest.mark.parametrize("goal", [Goal(range_error_m=0.005), Goal(capture_s=0.05)])
def test_the_recommended_sequence_measures_as_predicted(
    goal: Goal, wall: tuple[Planner, SceneStatistics]
) -> None:
    planner, scene = wall

    best = planner.plan(goal, scene).recommended

    values, device_s, saturated = measured("wall", best.applied.sequence, best.estimator, 10)
    figure = best.predicted.range_error
    assert values["error"] == pytest.approx(figure.median, rel=0.2)
    assert device_s == pytest.approx(best.applied.capture_s, rel=5e-3)
    assert saturated == 0.0
    if goal.range_error_m is not None:
        assert values["error"] <= goal.range_error_m


# -- computing ----------------------------------------------------------------------------------


def test_computing_time_is_measured_once_and_grows_with_takes(capabilities: Capabilities) -> None:
    ticks = iter(range(10_000))
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: float(next(ticks)))

    first = seconds(Sequence(harmonics=3), "pisarenko")
    used = next(ticks)
    again = seconds(Sequence(harmonics=3), "pisarenko")

    assert first is not None
    assert first == again
    assert first > 0
    assert next(ticks) == used + 1
    several = seconds(Sequence(harmonics=3, takes=4), "pisarenko")
    assert several is not None
    assert several >= first


def test_no_computing_time_is_stated_before_the_kernels_of_a_frame_are_there(
    capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: set[tuple[str, int]] = set()
    monkeypatch.setattr(
        tm.kernels, "settled", lambda names, m: all((name, m) in compiled for name in names)
    )
    monkeypatch.setattr(
        tm.kernels, "compile", lambda orders, _, names: compiled.update(product(names, orders))
    )
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS)
    sequence = Sequence(harmonics=3)

    assert seconds(sequence, "maximum-entropy") is None
    assert seconds.once_compiled(sequence, "maximum-entropy") is not None
    assert ("peaks", 3) in compiled
    assert seconds(sequence, "maximum-entropy") is not None
    assert seconds(sequence, "likelihood") is None


def test_a_plan_within_a_budget_of_computing_time_says_that_it_compiles(
    capabilities: Capabilities, monkeypatch: pytest.MonkeyPatch
) -> None:
    orders: set[int] = set()
    monkeypatch.setattr(tm.kernels, "settled", lambda names, m: m in orders)
    monkeypatch.setattr(tm.kernels, "compile", lambda new, _, names: orders.update(new))
    small = dataclasses.replace(capabilities, width=8, height=6)
    planner = Planner(small, tm.noise.Sensor(), SETTINGS)
    goal = Goal(capture_s=0.05, computing_share=0.9, estimator="likelihood")
    steps: list[str] = []

    found = planner.plan(
        goal, uniform_scene(4e5, [(2.0, 1.0)]), Progress(lambda share, step: steps.append(step))
    )

    share = found.recommended.computing_share
    assert share is not None
    assert 0 < share <= 0.9
    said = {step for step in steps if step.startswith("compiling")}
    assert said == {f"compiling kernels for m = {m}" for m in orders}
    assert found.recommended.applied.sequence.harmonics in orders


def test_a_budget_of_computing_time_affords_nothing_that_is_unknown() -> None:
    goal = Goal(computing_share=0.5)

    assert goal.affords_computing(0.5)
    assert not goal.affords_computing(0.6)
    assert not goal.affords_computing(None)
    assert Goal(capture_s=1.0).affords_computing(None)


# -- the command --------------------------------------------------------------------------------

NEARBY: dict[str, Any] = {
    "camera": "sim:mirrors",
    "brightness_dn_per_s": 8e5,
    "returns": ["1.5", "3:0.5"],
    "fixed": ["harmonics=3", "zeroth=on-off", "base_frequency_hz=23e6"],
}


def test_the_command_prints_a_plan_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, range_error_m=0.01, as_json=True)

    said = json.loads(capsys.readouterr().out)
    assert said["sequence"]["harmonics"] == 3
    assert said["sequence"]["zeroth"] == "on-off"
    assert said["predicted"]["range_error_m"]["median"] <= 0.01
    assert said["predicted"]["range_bias_m"] <= said["predicted"]["range_error_m"]["median"]
    assert said["estimator"] in ("maximum-entropy", "likelihood")


def test_the_command_prints_a_plan_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, capture_s=0.1, separation_m=1.0, bound_width=9.0)

    first, *words = capsys.readouterr().out.splitlines()
    assert Sequence.from_document(json.loads(first)).harmonics == 3
    assert any(line.startswith("captures in") for line in words)
    assert any("bias" in line and "outliers" in line for line in words)
    assert any("both returns" in line for line in words)
    assert any("mean density" in line for line in words)
    assert any(line.startswith("half the time") for line in words)


def test_the_command_fails_with_the_best_where_a_target_is_out_of_reach(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(typer.Exit) as ended:
        plan_verb.plan(**NEARBY, range_error_m=1e-9, as_json=True)

    assert ended.value.exit_code == 1
    assert json.loads(capsys.readouterr().out)["field"] == "range_error_m"


@pytest.mark.parametrize(
    "mistake",
    [
        {"fixed": ["harmonics"]},
        {"returns": ["near"]},
        {"returns": ["1:-2"]},
        {"estimator": "guess"},
    ],
)
def test_the_command_refuses_what_it_cannot_read(mistake: dict[str, Any]) -> None:
    with pytest.raises(typer.BadParameter):
        plan_verb.plan(**(NEARBY | mistake), capture_s=0.1)
