import numpy as np
import pytest

from tests.client.conftest import frame_meta
from transientcam import Frame
from transientcam.robotics._rerun_bridge import FRAMES, Scatter


def a_frame(values: object, *, sequence_id: int = 1) -> Frame:
    array = np.asarray(values, dtype=np.float32)
    return Frame("range", "m", ("y", "x"), frame_meta(sequence_id=sequence_id), array)


def test_it_is_the_median_of_the_pixels_standard_deviations() -> None:
    scatter = Scatter()
    # alternating by +-a, N values have the sum of squares N a^2: the deviation is a sqrt(N/(N-1))
    amplitude_m = np.array([[0.001, 0.002, 0.005]])
    found = [scatter.add(a_frame(2.0 + (-1) ** n * amplitude_m)) for n in range(FRAMES)]

    assert found[:-1] == [None] * (FRAMES - 1)
    assert found[-1] == pytest.approx(0.002 * np.sqrt(FRAMES / (FRAMES - 1)), rel=1e-4)


def test_pixels_that_lack_a_value_in_some_frame_are_left_out() -> None:
    scatter = Scatter()
    values = [[[n % 2, np.nan if n == 3 else 100.0 * (n % 2)]] for n in range(FRAMES)]

    *_, last = [scatter.add(a_frame(each)) for each in values]

    assert last == pytest.approx(0.5 * np.sqrt(FRAMES / (FRAMES - 1)))


def test_without_any_value_there_is_none() -> None:
    scatter = Scatter()

    assert [scatter.add(a_frame([[np.nan]])) for _ in range(FRAMES)] == [None] * FRAMES


def test_frames_of_other_settings_are_not_compared() -> None:
    scatter = Scatter()
    for _ in range(FRAMES):
        scatter.add(a_frame([[1.0]]))

    assert scatter.add(a_frame([[9.0]], sequence_id=2)) is None
    *_, last = [scatter.add(a_frame([[9.0]], sequence_id=2)) for _ in range(FRAMES - 1)]
    assert last == 0.0
