"""The front of all that no other beats, and the lines that its choices lie on."""

import itertools
import math
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.server.planning.closed_form import ClosedForm
from transientcam_driver import Capabilities
from transientcam_server.planning import Goal, Progress
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._search.families import families
from transientcam_server.planning._search.search import curves
from transientcam_server.planning._search.tradeoff import _coarse_to_fine, _times_s, fronts, lines


def test_lines_fall_onto_the_bias(capabilities: Capabilities) -> None:
    predictor = cast(Predictor, ClosedForm())
    goal = Goal()
    found = families(goal, predictor, capabilities)
    candidates = curves(found, goal, predictor, capabilities, lambda *_: 1e-3)

    shares: list[float] = []
    progress = Progress(lambda share, step: shares.append(share))
    *so_far, front = fronts(candidates, "range_error_m", progress)
    ends = front[0].applied.capture_s, front[-1].applied.capture_s
    for part in so_far[1:]:
        times_s = [choice.applied.capture_s for choice in part]
        assert times_s == sorted(times_s)
        assert (times_s[0], times_s[-1]) == ends, "both ends first, then what is between"
    assert [len(part) for part in so_far] == sorted(len(part) for part in so_far)

    assert shares == sorted(set(shares))
    assert (shares[0], len(shares)) == (0.0, 12)

    times_s = [choice.applied.capture_s for choice in front]
    assert len(front) > 3
    assert times_s == sorted(times_s)
    for line in lines(candidates, front):
        points = line["points"]
        noise_m = [point["range_std_m"] for point in points]
        assert noise_m == sorted(noise_m, reverse=True)
        assert len({point["range_bias_m"] for point in points}) == 1
        assert all(
            point["range_error_m"] == math.hypot(point["range_std_m"], point["range_bias_m"])
            for point in points
        )


@pytest.mark.parametrize(
    ("count", "order"),
    [
        (2, [0, 1]),
        (3, [0, 2, 1]),
        (4, [0, 3, 1, 2]),
        (5, [0, 4, 2, 1, 3]),
        (9, [0, 8, 4, 2, 6, 1, 3, 5, 7]),
    ],
)
def test_ends_come_first_and_then_the_middle_of_a_widest_gap(count: int, order: list[int]) -> None:
    assert _coarse_to_fine(count) == order


def test_all_places_come_once_coarse_ones_first() -> None:
    for count in range(2, 40):
        order = _coarse_to_fine(count)
        assert sorted(order) == list(range(count))
        for seen in range(2, count):
            known = sorted(order[:seen])
            gaps = [after - before for before, after in itertools.pairwise(known)]
            place = order[seen]
            before = max(each for each in known if each < place)
            after = min(each for each in known if each > place)
            assert after - before == max(gaps)
            assert abs((place - before) - (after - place)) <= 1


@pytest.mark.parametrize(
    ("ends_s", "longest_s"),
    [([(0.02, 0.5), (0.03, 2.0)], 2.0), ([(0.02, 9.0)], 5.0), ([(6.0, 9.0)], 6.0)],
)
def test_a_front_has_twelve_times_at_equal_ratios_up_to_five_seconds(
    ends_s: list[tuple[float, float]], longest_s: float
) -> None:
    made = [tuple(SimpleNamespace(capture_s=each) for each in ends) for ends in ends_s]

    times_s = _times_s(cast(Any, made))

    shortest_s = ends_s[0][0]
    expected = [shortest_s * (longest_s / shortest_s) ** (k / 11) for k in range(12)]
    assert times_s == pytest.approx(expected, rel=1e-8)
    # rounding must not exclude the very times of the ends
    assert times_s[0] >= shortest_s
    assert times_s[-1] >= longest_s


def test_lines_are_of_at_most_sixteen_points_within_five_seconds(
    capabilities: Capabilities,
) -> None:
    predictor = cast(Predictor, ClosedForm())
    found = families(Goal(), predictor, capabilities)
    candidates = curves(found, Goal(), predictor, capabilities, lambda *_: 0)
    *_, front = fronts(candidates, "range_error_m")

    drawn = lines(candidates, front)

    frequencies = {
        (each.estimator, each.applied.sequence.harmonics, each.applied.sequence.base_frequency_hz)
        for each in front
    }
    assert frequencies == {
        (each["estimator"], each["harmonics"], each["base_frequency_hz"]) for each in drawn
    }
    for each in drawn:
        (curve,) = (
            curve
            for curve in candidates
            if curve[0].family.estimator == each["estimator"]
            and curve[0].applied.sequence.harmonics == each["harmonics"]
            and curve[0].applied.sequence.base_frequency_hz == each["base_frequency_hz"]
        )
        shown_s = [one.capture_s for one in curve if one.capture_s <= 5.0]
        times_s = [point["capture_s"] for point in each["points"]]
        assert min(8, len(shown_s)) <= len(times_s) < 16
        assert times_s == shown_s[:: max(1, len(shown_s) // 8)]
