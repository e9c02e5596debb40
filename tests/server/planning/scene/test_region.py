"""Regions of the picture: boxes and polygons of pixels."""

from typing import Any

import numpy as np
import pytest

from transientcam_server.errors import Problem
from transientcam_server.planning import Region


def drawn(text: str) -> list[str]:
    region = Region.of(text)
    assert region is not None
    return ["".join(".#"[inside] for inside in row) for row in region.mask(5, 6).tolist()]


def test_a_box_holds_its_pixels() -> None:
    assert drawn("1,2,3,2") == ["......", "......", ".###..", ".###..", "......"]
    assert drawn("5,4,1,1")[4] == ".....#"


def test_a_polygon_holds_what_is_inside_and_on_its_edges() -> None:
    assert drawn("0,0/4,0/0,4") == ["#####.", "####..", "###...", "##....", "#....."]
    # a notch is outside, whichever way round the corners go
    notched = "0,0/5,0/5,4/3,1/0,4", "0,4/3,1/5,4/5,0/0,0"
    assert drawn(notched[0]) == drawn(notched[1])
    assert drawn(notched[0])[4] == "#....#"


@pytest.mark.parametrize(
    "value",
    [
        [],
        [1, 2, 3],
        [0, 0, 0, 4],
        [-1, 0, 2, 2],
        [[0, 0], [1, 1]],
        [[0, 0], [1], [2, 2]],
        [1.5, 0, 2, 2],
    ],
)
def test_what_is_no_region_is_refused(value: list[Any]) -> None:
    with pytest.raises(Problem) as refusal:
        Region.of(value)

    assert (refusal.value.kind.slug, refusal.value.extensions["field"]) == (
        "invalid-request",
        "region",
    )


def test_a_region_has_to_be_in_the_picture() -> None:
    region = Region.of([2, 2, 5, 2])
    assert region is not None
    with pytest.raises(Problem, match="within 6 x 5 pixels"):
        region.mask(5, 6)
    with pytest.raises(Problem):
        Region.of("a,b,c,d")
    assert Region.of(None) is Region.of(None) is None
    np.testing.assert_array_equal(region.mask(9, 9), Region(region.corners[::-1]).mask(9, 9))
