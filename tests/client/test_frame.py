"""Frames as values."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.client.conftest import frame_meta
from transientcam import Frame
from transientcam.errors import ParameterError


def _frame(array: NDArray[Any], product: str = "range", unit: str = "m", **extra: object) -> Frame:
    return Frame(product, unit, ("y", "x"), frame_meta(frame=7), array, extra=extra)


def test_numpy_takes_a_frame_for_its_array_without_a_copy() -> None:
    frame = _frame(np.ones((2, 3), np.float32))

    assert np.asarray(frame) is frame.array
    assert np.mean(frame) == 1.0
    assert np.asarray(frame, dtype=np.float64).dtype == np.float64


def test_a_copy_of_a_frame_may_be_written_to() -> None:
    data = np.frombuffer(bytes(8), np.uint8).reshape(2, 4)
    frame = _frame(data)

    copy = np.array(frame)
    copy[0, 0] = 1

    assert frame.array[0, 0] == 0


@pytest.mark.parametrize(
    ("array", "expected"),
    [
        (
            np.array([[1.5, np.nan], [2.5, 3.0]]),
            "<Frame 7 range [2 x 2] 1.5 to 3 m, 25.0% without>",
        ),
        (np.array([[1.5]]), "<Frame 7 range [1 x 1] 1.5 to 1.5 m>"),
        (np.full((1, 2), np.nan), "<Frame 7 range [1 x 2] no value, m>"),
        (np.zeros((0, 2)), "<Frame 7 range [0 x 2] no value, m>"),
        (np.zeros((1, 1), np.complex64), "<Frame 7 range [1 x 1] complex m>"),
        (np.ones((1, 1), np.uint16), "<Frame 7 range [1 x 1] 1 to 1 m>"),
    ],
)
def test_a_frame_shows_what_it_is(array: NDArray[Any], expected: str) -> None:
    assert repr(_frame(array)) == expected


def test_times_and_labels_are_there_only_where_the_product_has_them() -> None:
    plain = _frame(np.ones((1, 1)))
    transient = _frame(np.ones((1, 1)), time_s=[1e-9])
    raw = _frame(np.ones((1, 1)), labels=[{"harmonic": 1}])

    assert plain.time_s is None
    assert plain.labels == ()
    assert transient.time_s is not None
    assert transient.time_s.tolist() == [1e-9]
    assert raw.labels == ({"harmonic": 1},)
    assert plain.frame == 7


def test_a_pointcloud_gives_the_points_that_there_are_one_a_row() -> None:
    planes = np.arange(12, dtype=np.float32).reshape(3, 2, 2)
    planes[:, 0, 1] = np.nan
    cloud = Frame("pointcloud", "m", ("coordinate", "y", "x"), frame_meta(frame=7), planes)

    assert cloud.points.tolist() == [[0, 4, 8], [2, 6, 10], [3, 7, 11]]
    assert cloud.points.flags.c_contiguous
    with pytest.raises(ParameterError, match="product is 'range'"):
        _ = _frame(np.ones((1, 1))).points
