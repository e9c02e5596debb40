"""Plans: the search against brute force, and what is predicted against what is then measured."""

import dataclasses
import json
from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import pytest
import typer
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Camera, Capabilities, Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_experiments.tradeoff.capture import repeatability
from transientcam_server.camera.source import sensor_of
from transientcam_server.cli import plan as plan_verb
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.noise import range_noise
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.planning import Choice, Goal, Plan, Planner, Predictor, uniform_scene
from transientcam_server.planning.candidates import candidates
from transientcam_server.planning.choice import choices_on_front
from transientcam_server.planning.plan import plan
from transientcam_server.planning.prediction import Deviation, both_found
from transientcam_server.planning.scene import scene_of_frame
from transientcam_server.planning.timing import ReconstructionTimer
from transientcam_server.settings import ReconstructionSettings, SensorSettings

Array = NDArray[Any]
SETTINGS = ReconstructionSettings()
FREQUENCY_HZ = 23e6


@pytest.fixture(scope="module")
def camera() -> Iterator[Camera]:
    with open_camera("sim:mirrors?seed=11", clock=VirtualClock()) as opened:
        yield opened


@pytest.fixture(scope="module")
def capabilities(camera: Camera) -> Capabilities:
    return camera.capabilities


# -- the search ---------------------------------------------------------------------------------


class ClosedForm:
    """A predictor of one return and white noise, whose answers are formulas."""

    least_harmonics = 1

    def __init__(self, *, far_m: float = 2.0) -> None:
        self.scene = uniform_scene(1e6, [(far_m, 1.0)])

    def longest_exposure_s(self) -> float:
        return 0.004

    def range_std(self, sequence: Sequence) -> Deviation:
        m, light = sequence.harmonics, sequence.exposure_s * sequence.takes
        std_m = 1e-4 / np.sqrt(light * m * (m + 1)) / (sequence.base_frequency_hz / 23e6)
        return Deviation(std_m, std_m, 1.0)

    def range_std_interval(self, sequence: Sequence) -> tuple[float, float]:
        std_m = self.range_std(sequence).median_m
        return 0.9 * std_m, 1.1 * std_m

    def range_bias_m(self, sequence: Sequence) -> float:
        return 0.0 if sequence.harmonics >= 3 else 1.0

    def beyond_scene(self, sequence: Sequence) -> bool:
        return False

    def bound_width(self, sequence: Sequence) -> float:
        return 6.0 / (sequence.harmonics + 1) + (0.5 if sequence.zeroth == "estimated" else 0.0)

    def separation(self, sequence: Sequence, distance_m: float) -> float:
        return 1.0 - float(0.5 ** (sequence.harmonics * distance_m))


def planned(goal: Goal, capabilities: Capabilities, *, seconds: float = 1e-3) -> Plan:
    predictor = cast(Predictor, ClosedForm())
    return plan(goal, predictor, capabilities, reconstruct_s=lambda _: seconds)


def everything(goal: Goal, capabilities: Capabilities) -> list[Choice]:
    predictor = cast(Predictor, ClosedForm())
    return candidates(goal, predictor, capabilities, reconstruct_s=lambda _: 1e-3)


def test_a_target_gets_the_quickest_sequence_that_reaches_it(capabilities: Capabilities) -> None:
    goal = Goal(range_std_m=3e-4)

    best = planned(goal, capabilities).recommended

    reaching = [
        choice for choice in everything(goal, capabilities) if choice.range_std.median_m <= 3e-4
    ]
    assert best.range_std.median_m <= 3e-4
    assert best.applied.capture_s == min(choice.applied.capture_s for choice in reaching)


def test_a_plan_shows_what_it_recommends(capabilities: Capabilities) -> None:
    found = planned(Goal(range_std_m=0.02), capabilities)

    m, zeroth = (
        found.recommended.applied.sequence.harmonics,
        found.recommended.applied.sequence.zeroth,
    )
    assert repr(found).startswith(f"<Plan m = {m} at ")
    assert f"zeroth {zeroth}" in repr(found)
    assert repr(found).endswith(" mm>")
    assert "<th>half the time</th>" in found._repr_html_()


def test_a_budget_gets_the_most_accurate_sequence_within_it(capabilities: Capabilities) -> None:
    best = planned(Goal(frame_rate_hz=10.0), capabilities).recommended

    within = [
        choice
        for choice in everything(Goal(frame_rate_hz=10.0), capabilities)
        if choice.applied.frame_rate_hz >= 10.0
    ]
    assert best.applied.frame_rate_hz >= 10.0
    assert best.range_std.median_m == min(choice.range_std.median_m for choice in within)


def test_neighbours_take_half_the_time_and_have_half_the_error(capabilities: Capabilities) -> None:
    made = planned(Goal(capture_s=0.5), capabilities)
    document = made.to_document()

    assert made.half_time is not None
    assert made.twice_accuracy is not None
    assert document["half_time"]["time_factor"] <= 0.5
    assert document["half_time"]["error_factor"] > 1.0
    assert document["twice_accuracy"]["error_factor"] <= 0.5
    assert document["twice_accuracy"]["time_factor"] > 1.0
    on_front = choices_on_front(everything(Goal(capture_s=0.5), capabilities))
    assert made.half_time in on_front
    assert made.twice_accuracy.applied.capture_s in [each.applied.capture_s for each in on_front]


def test_what_the_camera_would_be_sent_is_what_was_predicted(capabilities: Capabilities) -> None:
    document = planned(Goal(range_std_m=1e-3), capabilities).to_document()

    applied = capabilities.apply(Sequence.from_document(document["sequence"]))

    assert applied.capture_s == pytest.approx(document["capture_s"], rel=1e-12)
    assert document["applied"]["images"] == applied.images


def test_fixed_fields_stay(capabilities: Capabilities) -> None:
    base = Sequence(harmonics=4, zeroth="on-off", takes=2)
    goal = Goal(capture_s=1.0, base=base, fixed=frozenset({"harmonics", "zeroth", "takes"}))

    chosen = planned(goal, capabilities).recommended.applied.sequence

    assert (chosen.harmonics, chosen.zeroth, chosen.takes) == (4, "on-off", 2)


def test_too_few_harmonics_for_the_scene_are_not_recommended(capabilities: Capabilities) -> None:
    chosen = planned(Goal(range_std_m=0.05), capabilities).recommended.applied.sequence

    assert chosen.harmonics >= 3


def test_harmonics_that_are_fixed_are_kept_and_their_bias_is_reported(
    capabilities: Capabilities,
) -> None:
    goal = Goal(range_std_m=0.05, base=Sequence(harmonics=2), fixed=frozenset({"harmonics"}))

    document = planned(goal, capabilities).to_document()

    assert document["sequence"]["harmonics"] == 2
    assert document["predicted"]["range_bias_m"] == 1.0


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
    choices = everything(Goal(capture_s=1.0), capabilities)
    far = cast(Predictor, ClosedForm(far_m=9.0))
    wide = candidates(Goal(capture_s=1.0), far, capabilities, reconstruct_s=lambda _: 1e-3)

    assert max(choice.applied.sequence.exposure_s for choice in choices) <= 0.9 * 0.004 + 1e-9
    assert {choice.applied.sequence.base_frequency_hz for choice in wide} == {11.5e6}


@pytest.mark.parametrize(
    ("goal", "field"),
    [
        (Goal(range_std_m=1e-9), "range_std_m"),
        (Goal(bound_width=1e-3), "bound_width"),
        (Goal(separation_m=1e-3), "separation_m"),
        (Goal(capture_s=1e-3), "capture_s"),
        (Goal(frame_rate_hz=1e3), "frame_rate_hz"),
        (Goal(computing_share=1e-9), "computing_share"),
        (Goal(range_std_m=1e-4, capture_s=0.06), "range_std_m"),
    ],
)
def test_what_is_out_of_reach_is_refused_with_the_best_there_is(
    goal: Goal, field: str, capabilities: Capabilities
) -> None:
    with pytest.raises(Problem) as refusal:
        planned(goal, capabilities)

    problem = refusal.value
    assert problem.kind.slug == "target-unreachable"
    assert problem.extensions["field"] == field
    best = cast(dict[str, Any], problem.extensions["best"])
    again = capabilities.apply(Sequence.from_document(best["sequence"]))
    assert again.capture_s == pytest.approx(best["capture_s"])
    if goal.capture_s == 0.06:
        assert best["capture_s"] <= 0.06  # the best that the budget allows


def test_the_best_that_is_reported_can_be_reached(capabilities: Capabilities) -> None:
    with pytest.raises(Problem) as refusal:
        planned(Goal(range_std_m=1e-9), capabilities)

    best = cast(float, refusal.value.extensions["limit"])

    assert planned(Goal(range_std_m=best), capabilities).recommended.range_std.median_m == best


@pytest.mark.parametrize(
    "goal",
    [Goal(), Goal(range_std_m=-1.0), Goal(capture_s=float("nan")), Goal(separation_share=1.5)],
)
def test_a_goal_that_cannot_be_meant_is_refused(goal: Goal, capabilities: Capabilities) -> None:
    with pytest.raises(Problem) as refusal:
        planned(goal, capabilities)

    assert refusal.value.kind.slug == "invalid-request"


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
    assert scene.furthest_m == pytest.approx(3.0)


def test_the_scene_of_a_frame_is_what_its_moments_hold() -> None:
    phase, weight = np.array([1.0, 2.5]), np.array([600.0, 300.0])
    b = (weight * np.exp(1j * np.arange(4)[:, None] * phase)).sum(axis=1)
    b[0] += 10.0
    frame = np.broadcast_to(b[:, None, None], (4, 12, 10)).astype(np.complex64)
    found = tm.reconstruct(frame, SETTINGS.for_moments(base_frequency_hz=FREQUENCY_HZ))
    noise = tm.noise.MomentNoise(np.full((4, 12, 10), 4.0))

    scene = scene_of_frame(found, noise, exposure_s=0.001, base_frequency_hz=FREQUENCY_HZ)

    assert scene is not None
    np.testing.assert_allclose(scene.brightness_dn_per_s, 910e3, rtol=1e-4)
    assert scene.brightest_dn_per_s == pytest.approx(910e3, rel=1e-4)
    assert ((scene.share > 0).sum(axis=0) == 2).all()
    delay_s = np.sort(scene.delay_s, axis=0)[:2]
    np.testing.assert_allclose(
        delay_s, np.broadcast_to(phase[:, None], delay_s.shape) / (2 * np.pi * 23e6), rtol=1e-3
    )


def test_a_dark_frame_is_no_scene() -> None:
    found = tm.reconstruct(
        np.zeros((3, 5, 5), np.complex64), SETTINGS.for_moments(base_frequency_hz=FREQUENCY_HZ)
    )

    noise = tm.noise.MomentNoise(np.ones((3, 5, 5)))

    assert scene_of_frame(found, noise, exposure_s=0.001, base_frequency_hz=FREQUENCY_HZ) is None


# -- prediction ---------------------------------------------------------------------------------


def test_deviation_of_one_return_at_one_frequency_is_the_closed_form() -> None:
    sensor = tm.noise.Sensor()
    predictor = Predictor(uniform_scene(4e5, [(2.0, 1.0)]), sensor, SETTINGS)
    sequence = Sequence(harmonics=1, exposure_s=0.001, takes=2, zeroth="estimated")

    predicted = predictor.range_std(sequence)

    b0, gain = (
        400.0,
        abs(tm.nominal_calibration(1, sequence.sub_phases.phases_rad, zeroth="on-off")[1]),
    )
    variance = (b0 / 9.0 + 2 * (30 / 9.0) ** 2 + 1 / 6) / gain**2 / 2
    std_rad = np.sqrt(variance * tm.noise.smoothing_factor(0.6)) / b0
    assert predicted.median_m == pytest.approx(tm.range_m(std_rad, FREQUENCY_HZ), rel=0.02)
    assert predicted.first_order_share == 1.0


def test_both_returns_count_as_found_only_near_their_places() -> None:
    phase = np.array([[1.0, 1.0, 1.0], [2.0, 1.6, 2.0]])
    weight = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 0.05]])
    returns = tm.Returns(phase, weight, np.zeros(3), np.full(3, 2))

    found = both_found(returns, np.array([1.0, 2.0]), threshold=0.1)

    np.testing.assert_array_equal(found, [True, False, False])


def captured(camera: Camera, sequence: Sequence, frames: int) -> list[tm.Reconstruction]:
    applied = camera.configure(sequence)
    recipe = Recipe(applied, SETTINGS, 2.0**camera.capabilities.bits - 1.0)
    camera.start()
    found = [recipe.reconstruct(camera.read_frame()) for _ in range(frames)]
    camera.stop()
    return found


@pytest.fixture(scope="module")
def predictor(camera: Camera) -> Predictor:
    sequence = Sequence(harmonics=6, takes=16, exposure_s=0.0015)
    sensor = sensor_of(camera, SensorSettings())
    planner = Planner(camera.capabilities, sensor, SETTINGS)
    (found,) = captured(camera, sequence, 1)
    recipe = Recipe(camera.applied, SETTINGS, 4095.0, sensor=sensor)
    return Predictor(planner.scene_statistics(recipe, found, 0.0), sensor, SETTINGS)


PINNED = frozenset({"base_frequency_hz"})
GOALS = [
    Goal(range_std_m=0.02, fixed=PINNED),
    Goal(range_std_m=0.004, fixed=PINNED),
    Goal(range_std_m=0.0015, fixed=PINNED),
    Goal(frame_rate_hz=16.0, fixed=PINNED),
    Goal(capture_s=0.3, fixed=PINNED),
    Goal(capture_s=0.12, base=Sequence(harmonics=3), fixed=PINNED | {"harmonics"}),
]


@pytest.mark.parametrize("goal", GOALS, ids=lambda goal: goal.leading)
def test_the_recommended_sequence_measures_as_predicted(
    goal: Goal, camera: Camera, predictor: Predictor
) -> None:
    best = plan(goal, predictor, camera.capabilities, reconstruct_s=lambda _: 1e-3).recommended

    found = captured(camera, best.applied.sequence, 6)
    measured_m = repeatability(np.stack([np.asarray(each.range_m) for each in found]))

    assert measured_m == pytest.approx(best.range_std.median_m, rel=0.25)


def test_bounds_measure_as_predicted(camera: Camera, predictor: Predictor) -> None:
    goal = Goal(bound_width=0.8, fixed=PINNED)
    best = plan(goal, predictor, camera.capabilities, reconstruct_s=lambda _: 1e-3).recommended

    (found,) = captured(camera, best.applied.sequence, 1)
    b = np.asarray(found.moments)[:, ::7, ::7]
    lower, upper = tm.bounds(b, 2 * np.pi * np.arange(32) / 32)
    width = np.median(2 * np.pi * (upper - lower).mean(axis=0) / b[0].real)

    assert width == pytest.approx(best.bound_width, rel=0.25)


def test_frames_say_their_own_deviation(camera: Camera) -> None:
    sensor = sensor_of(camera, SensorSettings())
    found = captured(camera, Sequence(harmonics=3), 6)
    measured_m = repeatability(np.stack([np.asarray(each.range_m) for each in found]))

    predicted = range_noise(Recipe(camera.applied, SETTINGS, 4095.0, sensor=sensor), found[0])

    assert predicted is not None
    assert measured_m == pytest.approx(predicted.median_m, rel=0.25)
    assert predicted.median_m < predicted.p90_m
    assert 0.3 < predicted.first_order_share < 1.0


# -- computing ----------------------------------------------------------------------------------


def test_computing_time_is_measured_once_and_grows_with_takes(capabilities: Capabilities) -> None:
    ticks = iter(range(10_000))
    small = dataclasses.replace(capabilities, width=8, height=6)
    seconds = ReconstructionTimer(small, SETTINGS, clock=lambda: float(next(ticks)))

    first = seconds(Sequence(harmonics=3))
    used = next(ticks)
    again = seconds(Sequence(harmonics=3))

    assert first == again == 1.0
    assert next(ticks) == used + 1
    assert seconds(Sequence(harmonics=3, takes=4)) >= first


# -- the command --------------------------------------------------------------------------------

NEARBY: dict[str, Any] = {
    "camera": "sim:mirrors",
    "brightness_dn_per_s": 8e5,
    "returns": ["1.5", "3:0.5"],
    "fixed": ["harmonics=3", "zeroth=on-off", "base_frequency_hz=23e6"],
}


def test_the_command_prints_a_plan_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, range_std_m=0.01, as_json=True)

    said = json.loads(capsys.readouterr().out)
    assert said["sequence"]["harmonics"] == 3
    assert said["sequence"]["zeroth"] == "on-off"
    assert said["predicted"]["range_std_m"]["median"] <= 0.01


def test_the_command_prints_a_plan_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    plan_verb.plan(**NEARBY, capture_s=0.1, separation_m=1.0, bound_width=9.0)

    first, *words = capsys.readouterr().out.splitlines()
    assert Sequence.from_document(json.loads(first)).harmonics == 3
    assert any(line.startswith("captures in") for line in words)
    assert any("both returns" in line for line in words)
    assert any("mean density" in line for line in words)
    assert any(line.startswith("half the time") for line in words)


def test_the_command_fails_with_the_best_where_a_target_is_out_of_reach(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(typer.Exit) as ended:
        plan_verb.plan(**NEARBY, range_std_m=1e-9, as_json=True)

    assert ended.value.exit_code == 1
    assert json.loads(capsys.readouterr().out)["field"] == "range_std_m"


@pytest.mark.parametrize(
    "mistake", [{"fixed": ["harmonics"]}, {"returns": ["near"]}, {"returns": ["1:-2"]}]
)
def test_the_command_refuses_what_it_cannot_read(mistake: dict[str, Any]) -> None:
    with pytest.raises(typer.BadParameter):
        plan_verb.plan(**(NEARBY | mistake), capture_s=0.1)
