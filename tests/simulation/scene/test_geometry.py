"""Ellipsoids, cells and interpolation against closed forms."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_simulation.light import _compiled_tiles as compiled_tiles
from transientcam_simulation.light._shares import axes_of
from transientcam_simulation.scene import Cells, Ellipsoid, Rectangle, cells_of, evenly


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


BALL = Ellipsoid(v(0, 3, 0), v(1, 1, 1))


def test_a_segment_meets_a_sphere_at_its_distance_less_the_radius() -> None:
    at = BALL.hit(v(0, 0, 0)[None], v(0, 10, 0)[None])
    beside = BALL.hit(v(2, 0, 0)[None], v(2, 10, 0)[None])
    behind = BALL.hit(v(0, 5, 0)[None], v(0, 15, 0)[None])

    assert at == pytest.approx([0.2])
    assert np.isinf([*beside, *behind]).all()


def test_a_way_that_starts_on_a_sphere_meets_it_only_through_its_inside() -> None:
    start = np.tile(v(0, 2, 0), (2, 1))

    at = BALL.hit(start, np.array([v(0, 0, 0), v(0, 12, 0)]))

    assert np.isinf(at[0])
    assert at[1] == pytest.approx(0.2)  # out of its far side


def test_normals_of_an_ellipsoid_are_across_its_surface() -> None:
    shape = Ellipsoid(v(1, 2, 3), v(0.5, 1.0, 2.0))
    angle = 0.7
    point = shape.centre + shape.radii * v(math.cos(angle), math.sin(angle), 0)
    along = shape.radii * v(-math.sin(angle), math.cos(angle), 0)

    (normal,) = shape.normals(point[None])

    assert normal @ along == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert normal @ (point - shape.centre) > 0


def cut(shape: Rectangle | Ellipsoid, edge_m: float) -> Cells:
    rows, columns = shape.grid(edge_m)
    return cells_of(shape, evenly(rows), evenly(columns))


def areas(cells: Cells) -> NDArray[np.float64]:
    one, other = (cells.corners[:, k + 2] - cells.corners[:, k] for k in (0, 1))
    area: NDArray[np.float64] = np.linalg.norm(np.cross(one, other), axis=-1) / 2
    return area


def test_uneven_cells_cover_a_rectangle_once() -> None:
    up, along = np.array([-1.0, -0.2, 0.9, 1.0]), np.array([-1.0, 0.1, 0.2, 0.7, 1.0])
    cells = cells_of(Rectangle.facing(v(0, 2, 0), v(0.3, -1, 0.2), size=(2.0, 1.0)), up, along)

    assert areas(cells) == pytest.approx(np.outer(np.diff(up), np.diff(along)).ravel() / 2)
    assert cells.corners.mean(axis=1) == pytest.approx(cells.centre)


def test_the_cells_of_an_ellipsoid_have_its_area_and_lie_on_it() -> None:
    """Of a prolate spheroid: 2 pi a^2 (1 + c / (a e) asin e), e^2 = 1 - a^2 / c^2."""
    a, c = 1.0, 2.0
    e = math.sqrt(1 - a * a / (c * c))
    area = 2 * math.pi * a * a * (1 + c / (a * e) * math.asin(e))
    cells = cut(Ellipsoid(v(0, 0, 0), v(a, a, c)), 0.05)

    assert areas(cells).sum() == pytest.approx(area, rel=5e-3)
    for points in (cells.centre, cells.corners):
        assert np.linalg.norm(points / [a, a, c], axis=-1) == pytest.approx(1)


@pytest.mark.parametrize(
    "shape", [Rectangle.facing(v(0, 2, 0), v(0.3, -1, 0.2), size=(2.0, 1.0)), BALL]
)
def test_corners_run_counter_clockwise_around_the_normal(shape: Rectangle | Ellipsoid) -> None:
    cells = cut(shape, 0.4)
    corners = cells.corners
    turned = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])  # diagonals

    assert (np.einsum("nc,nc->n", turned, cells.normal) > 0).all()


def test_interpolation_between_cells_of_a_rectangle_is_exact_for_planes() -> None:
    shape = Rectangle.facing(v(0, 2, 0), v(0, -1, 0), size=(2.0, 1.0))
    up, along = np.array([-1.0, 0.5, 0.7, 1.0]), np.array([-1.0, -0.9, 0.2, 0.6, 1.0])
    cells = cells_of(shape, up, along)
    values = cells.centre @ v(0.3, 0, -2.0) + 1
    points = v(0, 2, 0) + np.array([[x, 0, z] for x in (-1, -0.4, 0.99) for z in (-0.5, 0.13)])

    index, weights = shape.between_cells(points, cells)

    expected = points @ v(0.3, 0, -2.0) + 1
    assert (weights * values[index]).sum(axis=-1) == pytest.approx(expected)


def test_interpolation_between_cells_of_a_sphere_goes_around() -> None:
    cells = cut(BALL, 0.1)
    values = cells.centre @ v(1, 2, 3)
    random = np.random.default_rng(1)
    points = random.normal(size=(200, 3))
    points = BALL.centre + points / np.linalg.norm(points, axis=-1, keepdims=True)

    index, weights = BALL.between_cells(points, cells)

    assert weights.sum(axis=-1) == pytest.approx(1)
    error = (weights * values[index]).sum(axis=-1) - points @ v(1, 2, 3)
    assert np.abs(error).max() < 0.6  # at the poles, of values between 3 and 12
    assert np.sqrt(np.mean(error**2)) < 0.1


@pytest.mark.parametrize(
    "shape",
    [
        Ellipsoid(np.array([0.3, 1.5, -0.2]), np.array([0.1, 0.3, 0.5])),
        Rectangle.facing(np.array([-0.2, 1.2, 0.4]), np.array([0.3, -1.0, 0.2]), size=(0.6, 0.2)),
    ],
)
def test_tangents_are_those_of_the_outermost_points(shape: Ellipsoid | Rectangle) -> None:
    apex = np.array([0.1, -0.1, 0.05])
    middle, across = np.array([0.0, 0.8, 0.6]), np.array([0.6, -0.48, 0.64])
    points = _many_points(shape) - apex
    tangents = points @ across / (points @ middle)

    def found(apex: NDArray[np.float64], middle: NDArray[np.float64]) -> tuple[float, float]:
        if isinstance(shape, Rectangle):
            return shape.tangents(apex, middle, across)
        frame = np.array([middle, across, np.cross(middle, across)])
        low, high = compiled_tiles.tangents(axes_of([shape]), apex, frame)[0, 0]
        return low, high

    assert found(apex, middle) == pytest.approx((tangents.min(), tangents.max()), abs=2e-4)
    assert found(apex, -middle) == (-np.inf, np.inf)  # it lies behind the apex
    assert found(shape.centre, middle) == (-np.inf, np.inf)


def _many_points(shape: Ellipsoid | Rectangle) -> NDArray[np.float64]:
    steps = np.linspace(-1, 1, 401)
    u, v = (each.reshape(-1, 1) for each in np.meshgrid(steps, steps))
    if isinstance(shape, Rectangle):
        x, y = u * shape.width / 2, v * shape.height / 2
        return np.asarray(shape.centre + x * shape.right + y * shape.up)
    around = np.sqrt(1 - v * v)
    on_unit = np.hstack([around * np.cos(np.pi * u), around * np.sin(np.pi * u), v])
    return np.asarray(shape.centre + on_unit * shape.radii)
