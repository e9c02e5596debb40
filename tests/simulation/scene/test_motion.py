import numpy as np
import pytest

from transientcam_simulation.scene import Motion, speed_m_s
from transientcam_simulation.scene._motion import Repeat, carried

PATH = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 2.0, 0]])


@pytest.mark.parametrize(
    ("repeat", "time_s", "expected"),
    [
        ("restart", 0.0, [0, 0, 0]),
        ("restart", 1.0, [0.5, 0, 0]),
        ("restart", 3.0, [1, 1, 0]),
        ("restart", 4.0, [0, 0, 0]),
        ("back", 1.0, [1, 0, 0]),
        ("back", 2.0, [1, 2, 0]),
        ("back", 3.0, [1, 0, 0]),
        ("loop", 4 / 3, [1, 0, 0]),
        ("loop", 10 / 3, [0.5, 1, 0]),
    ],
)
def test_offsets_are_visited_at_equal_intervals_and_the_end_joins_the_start(
    repeat: Repeat, time_s: float, expected: list[float]
) -> None:
    motion = Motion(PATH, 4.0, repeat)

    assert motion.offset_m(time_s) == pytest.approx(expected)
    assert motion.offset_m(time_s + 8.0) == pytest.approx(expected)


def test_the_speed_is_that_of_the_fastest_part() -> None:
    assert Motion(PATH, 4.0).speed_m_s == pytest.approx(1.0)  # 2 m in one of two intervals
    assert Motion(PATH, 4.0, "back").speed_m_s == pytest.approx(2.0)


def test_turns_go_from_angle_to_angle_about_x_then_y_then_z() -> None:
    turns = Motion(np.zeros((2, 3)), 4.0, rotation_deg=np.array([[0.0, 0, 0], [90, 0, 180]]))

    assert turns.turn(2.0) @ [0, 0, 1] == pytest.approx([np.sqrt(0.5), 0, np.sqrt(0.5)])
    assert turns.turn(0.0) == pytest.approx(np.eye(3))
    back = Motion(np.zeros((2, 3)), 4.0, "back", turns.rotation_deg)
    assert back.turn(1.0) == pytest.approx(turns.turn(2.0))


def test_points_are_turned_about_a_centre_and_then_offset() -> None:
    quarter = np.array([[0.0, 0, 0], [0, 0, 180]])
    motions = (Motion(PATH, 4.0), Motion(np.zeros((2, 3)), 4.0, rotation_deg=quarter))
    centre = np.array([5.0, 0, 0])

    moved = carried(motions, 2.0, centre, np.array([centre, [6.0, 0, 0]]))

    assert moved == pytest.approx(np.array([[6.0, 0, 0], [6.0, 1, 0]]))


def test_the_speed_of_what_turns_is_that_of_its_farthest_point() -> None:
    full = Motion(np.zeros((2, 3)), 2.0, rotation_deg=np.array([[0.0, 0, 0], [0, 0, 360]]))
    points = np.array([[1.0, 0, 0], [-3.0, 0, 0]])

    assert speed_m_s((full,), np.zeros(3), points) == pytest.approx(3 * np.pi)
    assert speed_m_s((full, Motion(PATH, 4.0)), np.zeros(3), points) == pytest.approx(3 * np.pi + 1)
