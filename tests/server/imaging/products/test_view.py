from itertools import pairwise
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, strategies as st

from transientcam.documents import FrameDocument
from transientcam_server.errors import Problem
from transientcam_server.imaging import WHOLE, Crop

HEIGHT, WIDTH = 12, 17


def of(region: Any = None, decimation: Any = None) -> Crop:
    return Crop.of(region, decimation, height=HEIGHT, width=WIDTH)


@st.composite
def regions(draw: st.DrawFn) -> tuple[int, int, int, int]:
    x, y = draw(st.integers(0, WIDTH - 1)), draw(st.integers(0, HEIGHT - 1))
    return x, y, draw(st.integers(1, WIDTH - x)), draw(st.integers(1, HEIGHT - y))


@given(region=regions(), decimation=st.integers(1, 20))
def test_the_pixels_that_stay_are_those_counted_one_by_one(
    region: tuple[int, int, int, int], decimation: int
) -> None:
    x, y, width, height = region
    rows = [row for row in range(y, y + height) if (row - y) % decimation == 0]
    columns = [column for column in range(x, x + width) if (column - x) % decimation == 0]
    planes = np.arange(3 * HEIGHT * WIDTH).reshape(3, HEIGHT, WIDTH)
    crop = of(region, decimation)

    cropped = crop.apply(planes)

    expected = [[[plane[row][column] for column in columns] for row in rows] for plane in planes]
    assert np.array_equal(cropped, expected)
    assert cropped.flags.c_contiguous
    assert cropped.shape[-2:] == crop.shape(HEIGHT, WIDTH)


def test_the_whole_frame_is_not_copied_and_all_ways_to_ask_for_it_are_equal() -> None:
    plane = np.zeros((HEIGHT, WIDTH))

    assert WHOLE.apply(plane) is plane
    assert of() == of((0, 0, WIDTH, HEIGHT), 1) == WHOLE


def test_axes_are_cut_by_name_wherever_they_stand() -> None:
    points = np.arange(HEIGHT * WIDTH * 3).reshape(HEIGHT, WIDTH, 3)
    streak = np.arange(5 * WIDTH).reshape(5, WIDTH)
    crop = of((2, 3, 6, 4), 2)

    assert np.array_equal(crop.apply(points, ("y", "x", "xyz")), points[3:7:2, 2:8:2])
    assert np.array_equal(crop.apply(streak, ("time", "x")), streak[:, 2:8:2])


def test_what_meta_says_names_the_region_also_where_it_is_everything() -> None:
    meta = cast("FrameDocument", {"frame": 7, "width": WIDTH, "height": HEIGHT})

    whole, part = WHOLE.with_meta(meta), of((1, 2, 3, 4), 2).with_meta(meta)

    assert whole == {**meta, "region": [0, 0, WIDTH, HEIGHT], "decimation": 1}
    assert part == {**meta, "region": [1, 2, 3, 4], "decimation": 2}


def test_a_query_reads_the_same_as_four_numbers() -> None:
    parsed = Crop.parse(" 1,2, 3,4", 2, height=HEIGHT, width=WIDTH)

    assert parsed == of((1, 2, 3, 4), 2)
    assert Crop.parse(None, None, height=HEIGHT, width=WIDTH) == WHOLE


@pytest.mark.parametrize(
    "region",
    [
        (0, 0, WIDTH + 1, 1),
        (0, 0, 1, HEIGHT + 1),
        (WIDTH, 0, 1, 1),
        (-1, 0, 2, 2),
        (0, -1, 2, 2),
        (3, 3, 0, 2),
        (3, 3, 2, 0),
        (3, 3, -2, 2),
        (0, 0, 2),
        (),
        (0, 0, 1, 1, 1),
        (0.0, 0, 1, 1),
        (True, 0, 1, 1),
        ("0", 0, 1, 1),
    ],
)
def test_a_region_that_is_none_is_refused_with_what_would_do(region: tuple[Any, ...]) -> None:
    with pytest.raises(Problem) as caught:
        of(region)

    assert caught.value.kind.slug == "invalid-request"
    assert caught.value.extensions["field"] == "region"
    assert caught.value.extensions["value"] == list(region)
    assert f"{WIDTH} x {HEIGHT}" in str(caught.value.extensions["limit"])


@pytest.mark.parametrize("text", ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1;2;3;4", "1.5,0,1,1"])
def test_a_query_that_is_no_region_is_refused(text: str) -> None:
    with pytest.raises(Problem) as caught:
        Crop.parse(text, None, height=HEIGHT, width=WIDTH)

    assert caught.value.extensions["field"] == "region"


@pytest.mark.parametrize("decimation", [0, -1, 65, 1.5, True, "2"])
def test_a_decimation_out_of_range_is_refused_under_the_path_it_stood_at(decimation: Any) -> None:
    with pytest.raises(Problem) as caught:
        Crop.of(None, decimation, height=HEIGHT, width=WIDTH, path="subscriptions[1].")

    assert caught.value.extensions == {
        "field": "subscriptions[1].decimation",
        "value": decimation,
        "limit": "an integer from 1 to 64",
    }


def test_a_larger_step_never_leaves_more_pixels() -> None:
    shapes = [Crop(None, step).shape(HEIGHT, WIDTH) for step in range(1, 65)]

    assert shapes[-1] == (1, 1)
    assert all(rows <= before[0] for before, (rows, _) in pairwise(shapes))
