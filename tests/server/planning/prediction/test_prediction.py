"""Predicted errors against closed forms and captures."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import transientcam_moments as tm
from benchmarks.accuracy.capturing import measured
from tests.server.planning.looks import SETTINGS, looked
from transientcam_driver import Sequence
from transientcam_server.errors import Problem
from transientcam_server.planning import Goal, Planner, Region, SceneStatistics, uniform_scene
from transientcam_server.planning._prediction.averaging import LEAST_SHARE
from transientcam_server.planning._prediction.prediction import SWING, Prediction, Predictor
from transientcam_server.planning._scene.scene import one_of_each
from transientcam_server.planning._search.search import TOLERANCE

FREQUENCY_HZ = 23e6


@pytest.fixture(scope="module")
def wall() -> tuple[Planner, SceneStatistics]:
    return looked("sim:wall?seed=7")


def least_noise_m(predictor: Predictor, sequence: Sequence) -> float:
    setting = (sequence.exposure_s,), (sequence.takes,)
    (scale,), (least_m,), _ = predictor.bounds("single-frequency", sequence, setting)
    assert scale == pytest.approx(predictor.noise_scale(sequence))
    return least_m


@pytest.mark.parametrize(
    ("neighbours", "left"),
    [("edge-preserving", LEAST_SHARE), ("gaussian", tm.noise.smoothing_factor(0.6)), ("none", 1)],
)
def test_deviation_of_one_return_at_one_frequency_is_the_closed_form(
    neighbours: str, left: float
) -> None:
    sensor = tm.noise.Sensor()
    settings = SETTINGS.model_copy(update={"neighbours": neighbours})
    predictor = Predictor(uniform_scene(4e5, [(2.0, 1.0)]), sensor, settings)
    sequence = Sequence(harmonics=1, exposure_s=0.001, takes=2, zeroth="estimated")

    predicted = predictor.predict("single-frequency", sequence)

    b0, gain = (
        400.0,
        abs(tm.nominal_calibration(1, sequence.sub_phases.phases_rad, zeroth="on-off")[1]),
    )
    variance = (b0 / 9.0 + 2 * (30 / 9.0) ** 2 + 1 / 6) / gain**2 / 2
    std_rad = np.sqrt(variance * left) / b0
    expected_m = tm.range_m(std_rad, FREQUENCY_HZ)
    assert predicted.range_std.median == pytest.approx(expected_m, rel=0.05)
    # the median over 30 draws is itself that noisy
    assert predicted.range_bias_m < 0.25 * expected_m
    assert least_noise_m(predictor, sequence) == pytest.approx(expected_m, rel=1e-3)


def test_what_the_camera_does_is_part_of_the_error() -> None:
    sequence = Sequence(harmonics=1, exposure_s=0.001, zeroth="estimated")
    plain = uniform_scene(4e5, [(2.0, 1.0)])

    def predicted(takes: int = 1, capture_s: float = 0.0, **device: Any) -> Prediction:
        scene = dataclasses.replace(plain, base_frequency_hz=FREQUENCY_HZ, **device)
        predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS)
        captured = dataclasses.replace(sequence, takes=takes)
        return predictor.predict("single-frequency", captured, capture_s=capture_s)

    ideal = predicted()
    assert predicted(contrast=(1.0, 0.5)).range_std.median == pytest.approx(
        2 * ideal.range_std.median, rel=0.02
    )
    drifted = predicted(drift_m=0.4)
    assert drifted.range_bias_m == pytest.approx(0.2, rel=0.05)
    assert drifted.range_error.low < 1.5 * ideal.range_error.high
    assert drifted.range_error.high > 0.4
    speed_m_per_s = np.linspace(0.0, 40.0, plain.direct_m.size)
    moving = predicted(capture_s=0.1, swing_m_per_s=speed_m_per_s)
    assert moving.range_error.p90 == pytest.approx(SWING * 0.1 * 36.0, rel=0.02)
    # every image out of step: a range is anywhere; of several takes the others are left
    assert predicted(lost_share=1.0).range_std.median > 10 * ideal.range_std.median
    assert predicted(takes=3, lost_share=0.2).range_std == predicted(takes=3).range_std


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
    assert predicted.range_bias_m == pytest.approx(mixed - 1.5, rel=0.01)
    assert predicted.range_error.median == pytest.approx(mixed - 1.5, rel=0.01)


@pytest.mark.parametrize("goal", [Goal(range_error_m=0.005, share=None), Goal(capture_s=0.05)])
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


def test_as_many_captures_are_off_as_hold_a_lost_image() -> None:
    scene = dataclasses.replace(uniform_scene(4e5, [(2.0, 1.0)]), lost_share=0.07)
    predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS, share=0.9)
    sequence = Sequence(harmonics=1, exposure_s=0.02, zeroth="estimated")

    found = predictor.predict("single-frequency", sequence)

    # of four images at random phases few are not off by a centimetre
    assert 0.93**4 < found.share_within(0.01) < 0.93**4 + 0.05


def test_what_a_target_is_held_against_is_within_the_interval_of_a_known_bias() -> None:
    scene = uniform_scene(4e5, [(2.0, 1.0)])
    sequence = Sequence(harmonics=1, exposure_s=0.001, zeroth="estimated")

    for share in (None, 0.9):
        predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS, share=share)
        found = predictor.predict("single-frequency", sequence)
        error = found.within or found.range_error
        assert found.bias_known
        assert error.median < error.with_margin < error.high


def test_a_share_of_the_pixels_of_a_wall_is_within_what_its_noise_gives() -> None:
    scene = uniform_scene(4e5, [(2.0, 1.0)])
    sequence = Sequence(harmonics=1, exposure_s=0.001, takes=2, zeroth="estimated")
    of_median = Predictor(scene, tm.noise.Sensor(), SETTINGS)
    std_m = least_noise_m(of_median, sequence)

    for share, deviations in ((0.6827, 1.0), (0.9, 1.6449), (0.9545, 2.0)):
        predictor = Predictor(scene, tm.noise.Sensor(), SETTINGS, share=share)
        predicted = predictor.predict("single-frequency", sequence)
        assert predicted.within is not None
        # the median of 30 draws takes a little of the noise for bias, which is back in the sum
        assert predicted.within.median == pytest.approx(deviations * std_m, rel=0.04)
        assert predicted.within.low < predicted.within.median < predicted.within.with_margin
        assert predicted.share_within(deviations * std_m) == pytest.approx(share, abs=0.02)
        assert least_noise_m(predictor, sequence) < deviations * std_m
        scale = predictor.noise_scale(sequence)
        few_m = predictor.quick("single-frequency", sequence, scale)[2]
        assert 1 < few_m / (deviations * std_m) < TOLERANCE  # else a search overlooks it
    assert of_median.predict("single-frequency", sequence).within is None


def test_a_region_is_predicted_by_its_own_pixels(wall: tuple[Planner, SceneStatistics]) -> None:
    _, scene = wall
    region = Region.of([20, 30, 40, 50])

    part = scene.within(region)

    assert part.pixels is not None
    row, column = np.divmod(part.pixels, scene.shape[1])
    assert (row.min() >= 30, row.max() < 80, column.min() >= 20, column.max() < 60) == (True,) * 4
    assert part.lit_share == 1.0
    with pytest.raises(Problem, match="within 163 x 120 pixels"):
        scene.within(Region.of([150, 0, 20, 20]))


@pytest.mark.parametrize(("apart_m", "known"), [(0.0, True), (0.0001, True), (0.02, False)])
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
