"""Paths of light against closed forms and quadratures."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulation.path_tracer import REPETITIONS, Tracer
from transientcam_simulation.scene import parse_scene

C = 299_792_458.0
F_HZ = 69e6
Values = NDArray[np.float64]


def moments(surfaces: str, paths: int = 256, /, **changed: str) -> NDArray[np.complex128]:
    """Moments (repetition, f) at 0 and 69 MHz of the one pixel of a camera with a narrow view."""
    given = {
        "eye": "[0, 0, 0]",
        "at": "[0, 2, 0]",
        "lamp": "[0.3, 0, 0]",
        "aim": "[0, 2, 0]",
        "more": "",
        "transport": "",
    } | changed
    scene = parse_scene(f"""
        name = "a test's"
        [camera]
        position_m = {given["eye"]}
        look_at_m = {given["at"]}
        field_of_view_deg = 0.01
        [light]
        electrons_per_s = 1e6
        position_m = {given["lamp"]}
        aim_at_m = {given["aim"]}
        {given["more"]}
        [transport]
        {given["transport"]}
        {surfaces}""")
    found = Tracer(scene, (1, 1)).moments(np.array([0]), np.array([0.0, F_HZ]), paths=paths)
    return found[:, :, 0]


def require(found: NDArray[np.complex128], expected: list[complex], *, within: float) -> None:
    """Hold means to an expectation by their own standard error, which is to be small enough."""
    error = np.sqrt(np.var(found, axis=0, ddof=1) / REPETITIONS)
    assert (error < within * abs(expected[0])).all()
    apart = np.abs(found.mean(axis=0) - expected)
    assert (apart < 5 * error + 1e-6 * abs(expected[0])).all(), (found.mean(axis=0), expected)


def turned(weight: float, way_m: float) -> list[complex]:
    return [weight, weight * np.exp(2j * np.pi * F_HZ * way_m / C)]


def plate(centre: str, normal: str, size: str, more: str = 'kind = "diffuse"\nalbedo = 0.6') -> str:
    return f"[[surface]]\ncentre_m = {centre}\nnormal = {normal}\nsize_m = {size}\n{more}\n"


WALL = plate("[0, 2, 0]", "[0, -1, 0]", "[4, 4]")


def test_direct_light_of_a_wall_falls_with_distance_slope_and_beam() -> None:
    found = moments(WALL, aim="[0.3, 2, 0]", more="beam_exponent = 3")

    far = math.hypot(2, 0.3)
    slope = 2 / far
    require(found, turned(0.6 * slope * slope**3 / far**2, 2 + far), within=1e-4)


def test_light_that_enters_a_surface_comes_back_as_its_spread_says() -> None:
    more = 'kind = "translucent"\nalbedo = 0.6\nscatter_width_s = 4e-10\nscatter_decay_s = 1e-9'
    found = moments(plate("[0, 2, 0]", "[0, -1, 0]", "[4, 4]", more), lamp="[0, 0, 0]")

    omega = 2 * np.pi * F_HZ
    spread = np.exp(-0.5 * (omega * 4e-10) ** 2) / (1 - 1j * omega * 1e-9)
    direct = turned(0.6 / 4, 4)
    require(found, [direct[0], direct[1] * spread], within=1e-4)


@pytest.mark.parametrize("looks", ["lamp", "camera"])
def test_a_mirror_shows_what_stands_at_the_image(looks: str) -> None:
    """Lamp and camera change places: over the mirror comes the same light at the same time."""
    wall = plate("[0, 2, 0]", "[0, -1, 0]", "[1, 1]")
    mirror = plate("[1, 1, 0]", "[-1, 0, 0]", "[2, 2]", 'kind = "mirror"\nreflectivity = 0.9')
    far_m, beside_m = math.hypot(2, 2), math.hypot(2, 0.5)  # the wall's middle to (2, 0, 0)
    if looks == "camera":
        hides = plate("[0, 1, 0]", "[0, -1, 0]", "[0.1, 0.1]")  # the wall from the eye
        place = {"at": "[2, 2, 0]", "lamp": "[-0.5, 0, 0]"}
        over_m = math.hypot(2, 2.5)  # the lamp is seen in the mirror, too
        straight = turned(0.9 * 0.6 * 2 / beside_m**3, far_m + beside_m)
        over = turned(0.9**2 * 0.6 * 2 / over_m**3, far_m + over_m)
        expected = [a + b for a, b in zip(straight, over, strict=True)]
    else:
        hides = plate("[0, 1, 0]", "[0, -1, 0]", "[0.1, 0.1]")  # the wall from the lamp
        place = {"eye": "[-0.5, 0, 0]", "lamp": "[0, 0, 0]"}
        expected = turned(0.9 * 0.6 * 2 / far_m**3, far_m + beside_m)
    found = moments(wall + mirror + hides, transport="diffuse_bounces = 0", **place)
    require(found, expected, within=1e-4)


def test_a_pane_shows_its_dust_and_what_is_behind_it() -> None:
    """Straight on, lamp and camera in one place; of n = 1.5 two faces leave 12 / 13."""
    more = 'kind = "glass"\nalbedo = 0.1\nthickness_m = 0.01'
    pane = plate("[0, 1, 0]", "[0, 1, 0]", "[1, 1]", more)
    found = moments(
        WALL + pane, 2048, lamp="[0, 0, 0]", transport="diffuse_bounces = 0\nmirror_bounces = 1"
    )

    dust, wall = turned(0.1, 2), turned((0.9 * 12 / 13) ** 2 * 0.6 / 4, 4 + 2 * 0.005)
    require(found, [a + b for a, b in zip(dust, wall, strict=True)], within=0.01)


def test_a_half_mirror_parts_the_light_of_lamp_and_camera() -> None:
    """Aslant at 45 degrees: over it the board beside, twice with a lamp beside the camera."""
    more = 'kind = "glass"\nreflectivity = 0.3\nthickness_m = 0'
    pane = plate("[0, 1, 0]", "[-1, -1, 0]", "[1, 1]", more)
    board = plate("[-1.5, 1, 0]", "[1, 0, 0]", "[0.5, 0.5]")
    place = {"lamp": "[0, 0, 0]", "transport": "diffuse_bounces = 0\nmirror_bounces = 1"}
    found = moments(WALL + pane + board, 4096, **place)

    straight, over = math.hypot(1.5, 1), 2.5
    returns = [
        turned(0.7**2 * 0.6 / 4, 4),
        turned(0.3 * 0.6 * 1.5 / straight**3, 2.5 + straight),
        turned(0.3**2 * 0.6 / over**2, 2.5 + over),
    ]
    require(found, [sum(each) for each in zip(*returns, strict=True)], within=0.01)


def test_a_far_lamps_light_over_a_plate_is_its_form_factor() -> None:
    """A plate in even light above a small one: F of a point to a parallel rectangle (Lambert)."""
    small = plate("[0, 0, 0]", "[0, 0, 1]", "[0.02, 0.02]")
    above = plate("[0, 0, 1]", "[0, 0, -1]", "[2, 1.2]", 'kind = "diffuse"\nalbedo = 0.5')
    found = moments(
        small + above,
        4096,
        eye="[0, -1, 0.5]",
        at="[0, 0, 0]",
        lamp="[0, 0, -900]",
        aim="[0, 0, 0]",
        transport="diffuse_bounces = 1",
    )

    a, b = 1.0, 0.6
    root_a, root_b = math.sqrt(1 + a * a), math.sqrt(1 + b * b)
    corner = a / root_a * math.atan(b / root_a) + b / root_b * math.atan(a / root_b)
    factor = 4 * corner / (2 * math.pi)
    expected = 0.6 * 0.5 * factor / 901**2
    require(found[:, :1], [expected], within=0.02)


@pytest.mark.parametrize("seen", ["albedo = 0.6", "albedo = 0.2\ngloss = 0.5\ngloss_exponent = 30"])
@pytest.mark.parametrize("over_mirror", [False, True])
def test_a_bounce_is_the_integral_over_the_surface_that_is_lit(
    seen: str, over_mirror: bool
) -> None:
    """Matt or glossy floor, wall lit by a lamp that the floor does not see; over a mirror, too."""
    floor = plate("[0, 1, -0.5]", "[0, 0, 1]", "[0.01, 0.01]", f'kind = "diffuse"\n{seen}')
    wall = plate("[0, 1.5, 0]", "[0, -1, 0]", "[1, 0.8]")
    shade = plate("[0, 1.1, 0.1]", "[0, 0, 1]", "[0.2, 0.2]")
    mirror = plate("[0.8, 1.2, 0]", "[-1, 0, 0]", "[9, 9]", 'kind = "mirror"\nreflectivity = 0.7')
    lamp = np.array([0.0, 1.1, 0.3])
    found = moments(
        floor + wall + shade + (mirror if over_mirror else ""),
        2048,
        at="[0, 1, -0.5]",
        lamp="[0, 1.1, 0.3]",
        aim="[0, 1.1, 9]",
        transport="diffuse_bounces = 1\nmirror_bounces = 1",
    )

    across = (np.arange(400) + 0.5) / 400 - 0.5
    x, z = np.meshgrid(across, 0.8 * across)
    point = np.stack([x, np.full_like(x, 1.5), z], axis=-1).reshape(-1, 3)
    cell = 0.8 / point.shape[0]
    at = np.array([0.0, 1.0, -0.5])
    back = -at / np.linalg.norm(at)
    total = np.zeros(2, dtype=np.complex128)
    for mirrored_wall in (False, True) if over_mirror else (False,):
        for mirrored_lamp in (False, True) if over_mirror else (False,):
            source = np.array([1.6 - lamp[0], *lamp[1:]]) if mirrored_lamp else lamp
            image = point.copy()
            if mirrored_wall:
                image[:, 0] = 1.6 - image[:, 0]
            to_lamp, to_wall = source - point, image - at
            d1, d2 = np.linalg.norm(to_lamp, axis=1), np.linalg.norm(to_wall, axis=1)
            way = to_wall / d2[:, None]
            half = way + back
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            sent = 0.6 if "gloss" not in seen else 0.2 + 0.5 * 38 / 8 * half[:, 2].clip(0) ** 30
            received = (1.5 - source[1]) / d1**3  # by the wall
            gathered = way[:, 2].clip(0) * way[:, 1] / d2**2 / np.pi
            brought = sent * 0.6 * received * gathered * cell
            if not mirrored_wall:  # the shade is between
                brought = brought * clear(point, at)
            brought = brought * clear(point, source) * 0.7 ** (mirrored_wall + mirrored_lamp)
            way_m = d1 + d2 + np.linalg.norm(at)
            total += [brought.sum(), (brought * np.exp(2j * np.pi * F_HZ * way_m / C)).sum()]
    direct = moments(
        floor + shade + (mirror if over_mirror else ""),
        at="[0, 1, -0.5]",
        lamp="[0, 1.1, 0.3]",
        aim="[0, 1.1, 9]",
        transport="diffuse_bounces = 0\nmirror_bounces = 1",
    ).mean(axis=0)
    require(found, list(total + direct), within=0.02)


def clear(one: Values, other: Values) -> Values:
    """Whether the shade at z = 0.1 is not between points."""
    part = (0.1 - one[:, 2]) / np.where(other[2] == one[:, 2], np.nan, other[2] - one[:, 2])
    crossing = one + part[:, None] * (other - one)
    hidden = (
        (part > 0) & (part < 1) & (abs(crossing[:, 0]) < 0.1) & (abs(crossing[:, 1] - 1.1) < 0.1)
    )
    return np.asarray(~hidden, dtype=np.float64)


def test_a_closed_white_box_keeps_all_light_but_what_its_walls_take() -> None:
    """In a sphere's stead a cube: flux in is flux out, so irradiance adds up over bounces."""
    walls = ""
    for axis in range(3):
        for side in (-1, 1):
            centre, normal = [0.0, 0.0, 0.0], [0, 0, 0]
            centre[axis], normal[axis] = side, -side
            walls += plate(str(centre), str(normal), "[2, 2]", 'kind = "diffuse"\nalbedo = 0.5')
    lamp = {"lamp": "[0, 0, 0]", "aim": "[0, 1, 0]", "eye": "[0, 0, 0]"}
    nodes, weights = np.polynomial.legendre.leggauss(4)
    places = list(zip((nodes + 1) / 2, weights / 2, strict=True))  # of a quarter of one face
    irradiance = sum(
        w * v * moments(walls, at=f"[{x}, 1, {z}]", **lamp).mean(axis=0)[0].real / 0.5
        for x, w in places
        for z, v in places
    )
    # over six faces of 4 square metres: 4 pi in, and half of what comes goes on each time
    assert irradiance == pytest.approx(4 * np.pi / 24 / (1 - 0.5), rel=0.01)
