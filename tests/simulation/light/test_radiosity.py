"""Interreflection against closed form factors, brute force, and the conservation of energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_simulation.base import BIN_S
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Patches, form_factors
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import camera_rays
from transientcam_simulation.scene import Ellipsoid, Light, Rectangle, Scene, Surface, Viewpoint
from transientcam_simulation.scene._scene import Transport

C = 299_792_458.0
WIDTH, HEIGHT = 41, 31


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


def diffuse(shape: Rectangle | Ellipsoid, albedo: float = 0.5) -> Surface:
    return Surface("surface", "diffuse", shape, albedo)


def facing(
    centre: NDArray[np.float64], normal: NDArray[np.float64], size: tuple[float, float]
) -> Rectangle:
    return Rectangle.facing(centre, normal, size=size)


def scene(*surfaces: Surface, bounces: int = 1, patches: int = 24) -> Scene:
    return Scene(
        name="test",
        description="",
        file=None,
        light=Light(1.0, v(0.1, 0, 0), v(0, 100, 0), 0.0),
        camera=Viewpoint(v(0, 0, 0), v(0, 1, 0), 40.0),
        surfaces=surfaces,
        transport=Transport(diffuse_bounces=bounces, patches=patches),
    )


def further(of: Scene) -> Interreflection:
    assert of.camera is not None
    lit = light_rays(of, camera_rays(of.camera, width=WIDTH, height=HEIGHT))
    return Interreflection(of, lit, width=WIDTH, height=HEIGHT)


def test_form_factor_from_a_point_to_a_parallel_rectangle() -> None:
    """Its corner above the point, with A, B the sides over the distance (Howell, B-3)."""
    a, b, c = 0.8, 1.5, 2.0
    A, B = a / c, b / c
    expected = (
        A / math.hypot(1, A) * math.atan(B / math.hypot(1, A))
        + B / math.hypot(1, B) * math.atan(A / math.hypot(1, B))
    ) / (2 * math.pi)
    of = scene(diffuse(facing(v(a / 2, c, b / 2), v(0, -1, 0), (a, b))))

    factors = form_factors(of, Patches.of(of, 6), v(0, 0, 0)[None], v(0, 1, 0)[None])

    assert factors.sum() == pytest.approx(expected, rel=1e-12)


def test_form_factor_from_a_point_to_a_perpendicular_rectangle() -> None:
    """Standing on the point's plane, its side before the point (Howell, B-4)."""
    a, b, c = 1.2, 0.7, 0.9  # height, width, distance
    X, Y = a / b, c / b
    expected = (math.atan(1 / Y) - Y / math.hypot(X, Y) * math.atan(1 / math.hypot(X, Y))) / (
        2 * math.pi
    )
    of = scene(diffuse(facing(v(b / 2, c, a / 2), v(0, -1, 0), (b, a))))

    factors = form_factors(of, Patches.of(of, 5), v(0, 0, 0)[None], v(0, 0, 1)[None])

    assert factors.sum() == pytest.approx(expected, rel=1e-12)


def test_form_factor_from_a_point_to_a_sphere() -> None:
    """On its axis: the square of the sine of its angular radius."""
    of = scene(diffuse(Ellipsoid(v(0, 3, 0), v(1, 1, 1))), patches=40)

    factors = form_factors(of, Patches.of(of, 40), v(0, 0, 0)[None], v(0, 1, 0)[None])

    assert factors.sum() == pytest.approx((1 / 3) ** 2, rel=0.01)


def box(albedo: float, *, bounces: int) -> Scene:
    """A closed room, with the light in it."""
    half = 1.0
    walls = [
        facing(half * v(*axis), -v(*axis), (2 * half, 2 * half))
        for axis in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
    ]
    return scene(*(diffuse(wall, albedo) for wall in walls), bounces=bounces, patches=10)


def test_in_a_closed_room_all_light_ends_on_the_walls() -> None:
    of = box(0.5, bounces=1)
    patches = Patches.of(of, 10)

    shares = form_factors(of, patches, patches.centre, patches.normal).sum(axis=1)

    assert shares == pytest.approx(1, abs=2e-3)


def test_energy_is_conserved_over_many_bounces_in_a_closed_room() -> None:
    """Of all light on the walls, direct light is the share 1 - albedo."""
    albedo, bounces = 0.5, 8
    exchange = further(box(albedo, bounces=bounces))._exchange
    direct = exchange.radiosity.sum(axis=(0, 2)) / albedo * (2 / 10) ** 2

    indirect = exchange.irradiance(0.0, bounces).real * (2 / 10) ** 2

    # a geometric series, cut off after some bounces
    expected = albedo * (1 - albedo**bounces) / (1 - albedo)
    assert direct.sum() == pytest.approx(4 * math.pi, rel=0.01)
    assert indirect.sum() / direct.sum() == pytest.approx(expected, rel=5e-3)


def test_bounces_are_followed_until_what_is_left_is_negligible_and_no_further() -> None:
    room = replace(box(0.7, bounces=1), transport=Transport(diffuse_bounces=None, patches=6))
    exchange = Exchange.of(room, 6)
    tolerance = 1e-3 * float(exchange.radiosity.sum(axis=(0, 2)).max())

    bounces = exchange.bounces(tolerance)

    all_light = exchange.irradiance(0.0, 80).real

    def left(after: int) -> float:
        return float((0.7 * (all_light - exchange.irradiance(0.0, after).real)).max())

    assert left(bounces) < tolerance < left(bounces - 3)


def right_angle(*, bounces: int = 1, patches: int = 24) -> Scene:
    corner = find_scene("corner")
    return replace(corner, transport=Transport(diffuse_bounces=bounces, patches=patches))


@pytest.mark.parametrize("frequency_hz", [0.0, 23e6, 69e6])
def test_one_bounce_in_a_corner_is_the_integral_over_the_other_wall(frequency_hz: float) -> None:
    """Brute force: a sum over a fine grid of points, in the textbook's form."""
    of = right_angle()
    assert of.camera is not None
    lit = light_rays(of, camera_rays(of.camera, width=WIDTH, height=HEIGHT))
    moments = further(of).moments(frequency_hz)
    for row, column in ((15, 4), (8, 12), (15, 30), (25, 17)):
        ray = row * WIDTH + column
        x, mine = lit.point[ray], int(lit.surface[ray])
        other = of.surfaces[1 - mine].shape
        assert isinstance(other, Rectangle)
        n = 400
        u, w = np.meshgrid((np.arange(n) + 0.5) / n - 0.5, (np.arange(n) + 0.5) / n - 0.5)
        y = (
            other.centre
            + u.reshape(-1, 1) * other.width * other.right
            + w.reshape(-1, 1) * other.height * other.up
        )
        to_lamp, to_x = of.light.position_m - y, x - y
        lamp_m, x_m = np.linalg.norm(to_lamp, axis=1), np.linalg.norm(to_x, axis=1)
        shape = of.surfaces[mine].shape
        assert isinstance(shape, Rectangle)
        on_y = np.maximum(to_lamp @ other.normal, 0) / lamp_m**3
        cosines = np.maximum(to_x @ other.normal, 0) * np.maximum(-to_x @ shape.normal, 0)
        area = other.width * other.height / n**2
        given = 0.85 * on_y * cosines / (math.pi * x_m**4) * area
        delay_s = (lamp_m + x_m + lit.distance_m[ray]) / C
        expected = 0.85 * np.sum(given * np.exp(2j * np.pi * frequency_hz * delay_s))

        assert moments[row, column] == pytest.approx(expected, rel=0.01), (row, column)


def test_a_second_bounce_adds_less_than_the_first_and_later() -> None:
    one, two = further(right_angle(bounces=1)), further(right_angle(bounces=2))

    first_s, first = one.returns
    both_s, both = two.returns

    assert (both > first).all()
    assert (both - first < 0.6 * first).all()
    assert (both_s > first_s).all()


def test_the_histogram_of_a_pixel_has_the_moments_of_the_pixel() -> None:
    light = further(right_angle(bounces=3))
    weight = light.moments(0.0).real
    for x, y in ((5, 15), (30, 8)):
        start_s, mass = light.of_pixel(x, y, weight=float(weight[y, x]))

        time_s = start_s + BIN_S * (np.arange(len(mass)) + 0.5)
        assert mass.sum() == pytest.approx(weight[y, x])
        for frequency_hz in (23e6, 92e6):
            moment = np.sum(mass * np.exp(2j * np.pi * frequency_hz * time_s))
            assert abs(moment - light.moments(frequency_hz)[y, x]) < 0.02 * weight[y, x]


def test_a_flat_wall_gives_itself_nothing() -> None:
    wall = scene(diffuse(facing(v(0, 2, 0), v(0, -1, 0), (3, 3))))

    assert not further(wall).moments(0.0).any()


def test_what_stands_between_hides() -> None:
    open_view = right_angle()
    plate = diffuse(facing(v(0, 1.5, 0), v(1, 0, 0), (0.9, 1.9)), 0.0)
    hidden = replace(open_view, surfaces=(*open_view.surfaces, plate))

    share = further(hidden).moments(0.0).real.sum() / further(open_view).moments(0.0).real.sum()

    assert share < 0.75
