import numpy as np
import pytest

from transientcam_simulation.scene import Motion
from transientcam_simulation.scene._motion import Repeat

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
