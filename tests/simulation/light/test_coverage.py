"""Shares of pixels: of one shape, and of two whose borders cross the same pixels."""

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_simulation.light._coverage import covered, covered_among, overlapped

FINE = 64  # places a side of a pixel


def half_plane(
    angle_rad: float, offset: float, *, fine: bool = False, bent: float = 0.0
) -> NDArray[np.float32]:
    """How far 5 x 5 pixels, or places in them, are beyond a border; it bends by so much."""
    count = 5 * FINE if fine else 5
    along = (np.arange(count) + 0.5) * 5 / count - 2.5
    x, y = np.meshgrid(along, along)
    across = x * np.cos(angle_rad) + y * np.sin(angle_rad) - offset
    sideways = -x * np.sin(angle_rad) + y * np.cos(angle_rad)
    beyond: NDArray[np.float32] = (across + bent * (across**2 + sideways**2)).astype(np.float32)
    return beyond


def share_of(places: NDArray[np.bool_]) -> NDArray[np.float64]:
    share: NDArray[np.float64] = places.reshape(5, FINE, 5, FINE).mean(axis=(1, 3))
    return share


@pytest.mark.parametrize("angle_rad", [0.0, 0.4, 1.1, 2.5])
@pytest.mark.parametrize("bent", [0.0, -0.08])
def test_a_border_covers_the_share_that_many_places_find(angle_rad: float, bent: float) -> None:
    share, _root = covered(half_plane(angle_rad, 0.13, bent=bent), rooted=False)

    expected = share_of(half_plane(angle_rad, 0.13, fine=True, bent=bent) > 0)
    inner = (slice(1, 4), slice(1, 4))  # at the edge of the image slopes are from one side
    assert share[inner] == pytest.approx(expected[inner], abs=0.02)


@pytest.mark.parametrize(
    ("turned_rad", "offset", "within"),
    [(0.0, 0.3, 0.02), (0.15, 0.2, 0.03), (np.pi, 0.2, 0.02), (np.pi, -0.3, 0.02), (1.57, 0, 0.03)],
)
def test_two_shapes_overlap_in_a_pixel_as_their_borders_lie(
    turned_rad: float, offset: float, within: float
) -> None:
    borders = [(0.1, 0.1), (0.1 + turned_rad, offset)]
    one, other = (covered(half_plane(*border), rooted=False)[0] for border in borders)

    both = overlapped(one, other)

    first, second = (half_plane(*border, fine=True) > 0 for border in borders)
    inner = (slice(1, 4), slice(1, 4))
    assert both[inner] == pytest.approx(share_of(first & second)[inner], abs=within)


def test_scattered_pixels_are_covered_as_those_of_an_image() -> None:
    inside = half_plane(0.4, 0.13, bent=-0.08)
    place = np.full((7, 7), 25)
    place[1:-1, 1:-1] = np.arange(25).reshape(5, 5)
    around = np.array([place[:-2, 1:-1], place[2:, 1:-1], place[1:-1, :-2], place[1:-1, 2:]])

    share = covered_among(inside.ravel(), around.reshape(4, -1)).reshape(5, 5)

    inner = (slice(1, 4), slice(1, 4))  # beyond the edge of the image there is nothing
    assert share[inner] == pytest.approx(covered(inside, rooted=False)[0][inner], abs=1e-6)


def test_a_pixel_without_neighbours_is_covered_or_not() -> None:
    nowhere = np.full((4, 2), 2)

    share = covered_among(np.array([0.7, -0.2], dtype=np.float32), nowhere)

    assert share.tolist() == [1, 0]
