"""The Pareto front of points with a cost and an error."""

from hypothesis import given, strategies as st

from transientcam_server.planning import flat_from, front


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=30))
def test_the_front_is_what_no_other_point_beats(points: list[tuple[int, int]]) -> None:
    found = front(points, cost=lambda p: p[0], error=lambda p: p[1])

    unbeaten = {
        point
        for point in points
        if not any(
            other[0] <= point[0] and other[1] <= point[1] and other != point for other in points
        )
    }
    assert set(found) == unbeaten
    assert found == sorted(unbeaten)


def test_points_that_were_not_measured_are_on_no_front() -> None:
    points = [(1.0, float("nan")), (2.0, 1.0), (float("inf"), 0.0)]

    assert front(points, cost=lambda p: p[0], error=lambda p: p[1]) == [(2.0, 1.0)]


def test_a_front_is_flat_from_where_bias_rules_and_time_no_longer_halves_the_error() -> None:
    falling = [(0.01, 0.1, 0.1), (0.01, 0.02, 0.022), (0.008, 0.006, 0.01)]
    flat = [(0.003, 0.005, 0.006), (0.001, 0.004, 0.0041)]

    assert flat_from([*falling, *flat]) == len(falling)
    assert flat_from(falling[:2]) == 1
    assert flat_from(falling) is None
    assert flat_from([]) is None


def test_a_front_is_not_flat_while_more_time_leaves_less_than_half_of_the_error() -> None:
    last = (0.001, 0.01, 0.01)

    assert flat_from([(0.001, 0.019, 0.019), last]) == 0
    assert flat_from([(0.001, 0.025, 0.025), last]) == 1
