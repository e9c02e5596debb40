"""Shares of pixels: of one shape, and of two whose borders cross the same pixels."""

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_simulation.light._compiled_overlaps import overlapped
from transientcam_simulation.light._coverage import covered

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
    share = covered(half_plane(angle_rad, 0.13, bent=bent))

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
    one, other = (covered(half_plane(*border)) for border in borders)

    both = overlapped(one, other)

    first, second = (half_plane(*border, fine=True) > 0 for border in borders)
    inner = (slice(1, 4), slice(1, 4))
    assert both[inner] == pytest.approx(share_of(first & second)[inner], abs=within)


@pytest.mark.parametrize("shape", [(9, 11), (1, 11), (9, 1), (1, 1), (2, 2), (0, 5)])
def test_shares_are_all_or_nothing_away_from_borders_up_to_the_edge(shape: tuple[int, int]) -> None:
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32)
    inside = (3.0 - np.hypot(x - 4.2, y - 3.7)).astype(np.float32)
    inside[(x + 2 * y) % 7 == 0] = np.nan

    share = covered(inside)
    both = overlapped(share, (x > 3).astype(np.float32))

    padded = np.pad(inside > 0, 1, mode="edge" if inside.size else "constant")
    beside = (padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:])
    alike = np.logical_and.reduce([each == (inside > 0) for each in beside])
    assert (share[alike] == (inside > 0)[alike]).all()
    assert ((share >= 0) & (share <= 1)).all()
    assert (both == np.where(x > 3, share, 0)).all()
