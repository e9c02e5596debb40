"""Light transport against closed forms."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver.camera import Sensor
from transientcam_simulation.base import Lens, SparseResponses
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.light import _paths as paths
from transientcam_simulation.light._paths import ImageLight, Lit, image_lights, light_on, light_rays
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.light._still import StillLight
from transientcam_simulation.scene import Light, Rectangle, Scene, Surface, Viewpoint
from transientcam_simulation.scene._scene import Transport

C = 299_792_458.0
WIDTH, HEIGHT = 33, 25
CENTRE = (HEIGHT // 2, WIDTH // 2)


def trace(of: Scene, *, width: int, height: int) -> SparseResponses:
    return StillLight(of, width=width, height=height).responses()


def v(*values: float) -> NDArray[np.float64]:
    return np.array(values, dtype=np.float64)


def surface(
    kind: str,
    centre: NDArray[np.float64],
    normal: NDArray[np.float64],
    size: tuple[float, float] = (10.0, 10.0),
    *,
    reflectivity: float = 1.0,
    opaque: NDArray[np.bool_] | None = None,
) -> Surface:
    rectangle = Rectangle.facing(centre, normal, size=size)
    return Surface(kind, kind, rectangle, reflectivity, opaque)  # type: ignore[arg-type]  # a word


def scene(
    *surfaces: Surface,
    light: NDArray[np.float64] | None = None,
    bounces: int = 2,
    beam_exponent: float = 0.0,
    look_at: NDArray[np.float64] | None = None,
) -> Scene:
    return Scene(
        name="test",
        description="",
        file=None,
        light=Light(1.0, v(0, 0, 0) if light is None else light, v(0, 100, 0), beam_exponent),
        sensor=Sensor(),
        camera=Viewpoint(v(0, 0, 0), v(0, 1, 0) if look_at is None else look_at, 40.0),
        surfaces=surfaces,
        transport=Transport(mirror_bounces=bounces),
    )


WALL = surface("diffuse", v(0, 2, 0), v(0, -1, 0), reflectivity=0.5)


def pixel_points(distance_m: float) -> NDArray[np.float64]:
    """Where the camera's rays meet the plane y = distance, by similar triangles."""
    half = math.tan(math.radians(20))
    points = np.empty((HEIGHT, WIDTH, 3))
    for row in range(HEIGHT):
        for column in range(WIDTH):
            x = half * ((column + 0.5) / WIDTH * 2 - 1)
            z = half * HEIGHT / WIDTH * (1 - (row + 0.5) / HEIGHT * 2)
            points[row, column] = (distance_m * x, distance_m, distance_m * z)
    return points


def test_a_wall_returns_twice_its_distance_and_falls_off_as_cosine_over_square() -> None:
    delay_s, weight = trace(scene(WALL), width=WIDTH, height=HEIGHT).returns()

    distance_m = np.linalg.norm(pixel_points(2.0), axis=-1)
    assert delay_s[0] == pytest.approx(2 * distance_m / C)
    assert weight[0] == pytest.approx(0.5 * (2.0 / distance_m) / distance_m**2)


def test_a_beam_falls_off_with_the_power_of_its_cosine() -> None:
    beam = trace(scene(WALL, beam_exponent=3.0), width=WIDTH, height=HEIGHT).returns()[1]
    even = trace(scene(WALL), width=WIDTH, height=HEIGHT).returns()[1]

    cosine = 2.0 / np.linalg.norm(pixel_points(2.0), axis=-1)
    assert beam[0] == pytest.approx(even[0] * cosine**3)


def test_a_mirror_lights_the_wall_from_the_image_point() -> None:
    mirror = surface("mirror", v(1.5, 0, 0), v(-1, 0, 0), reflectivity=0.8)

    delay_s, weight = trace(scene(WALL, mirror), width=WIDTH, height=HEIGHT).returns()

    points = pixel_points(2.0)
    way = v(3.0, 0, 0) - points  # the light at the origin appears at x = 3
    length_m = np.linalg.norm(way, axis=-1)
    cosine = -way[..., 1] / length_m
    assert delay_s[1] == pytest.approx((length_m + np.linalg.norm(points, axis=-1)) / C)
    assert weight[1] == pytest.approx(0.8 * 0.5 * cosine / length_m**2)


def test_two_facing_mirrors_give_the_images_of_images() -> None:
    right = surface("mirror", v(1.5, 0, 0), v(-1, 0, 0), reflectivity=0.8)
    left = surface("mirror", v(-1.0, 0, 0), v(1, 0, 0), reflectivity=0.9)

    responses = trace(scene(WALL, right, left), width=WIDTH, height=HEIGHT)

    point = pixel_points(2.0)[CENTRE]
    images = [(0, 1.0), (3, 0.8), (-2, 0.9), (-5, 0.72), (5, 0.72)]  # x of the image, reflectivity
    expected = sorted((math.dist((x, 0, 0), point), reflectivity) for x, reflectivity in images)
    delay_s, weight = responses.of_pixel(CENTRE[1], CENTRE[0])
    assert delay_s * C - np.linalg.norm(point) == pytest.approx([d for d, _ in expected])
    assert weight == pytest.approx([0.5 * r * 2.0 / d**3 for d, r in expected])


def test_the_bounce_limit_is_kept() -> None:
    mirrors = (
        surface("mirror", v(1.5, 0, 0), v(-1, 0, 0)),
        surface("mirror", v(-1.0, 0, 0), v(1, 0, 0)),
    )

    counts = [
        len(trace(scene(WALL, *mirrors, bounces=b), width=3, height=3).returns()[0])
        for b in range(4)
    ]

    assert counts == [1, 3, 5, 7]


def test_a_mirror_lights_only_what_its_rectangle_reaches() -> None:
    """The patch of light is the mirror's shadow as seen from the image point."""
    mirror = surface("mirror", v(1.5, 1.0, 0), v(-1, 0, 0), (0.2, 0.4))

    weight = trace(scene(WALL, mirror), width=WIDTH, height=HEIGHT).returns()[1]

    points = pixel_points(2.0)
    # from (3, 0, 0) through the mirror (x = 1.5, y from 0.9 to 1.1, z from -0.2 to 0.2)
    share = 1.5 / (3.0 - points[..., 0])
    y, z = share * points[..., 1], share * points[..., 2]
    lit = (np.abs(y - 1.0) < 0.1) & (np.abs(z) < 0.2)
    assert lit.any()
    assert ((weight > 0).sum(axis=0) == 1 + lit).all()


def test_the_back_of_a_mirror_reflects_nothing() -> None:
    mirror = surface("mirror", v(1.5, 0, 0), v(1, 0, 0))

    assert len(trace(scene(WALL, mirror), width=3, height=3).returns()[0]) == 1


def test_a_mirror_in_the_view_shows_the_wall_behind_the_camera() -> None:
    mirror = surface("mirror", v(0, 2, 0), v(0, -1, 0), reflectivity=0.5)
    behind = surface("diffuse", v(0, -1, 0), v(0, 1, 0), reflectivity=1.0)

    delay_s, weight = trace(scene(mirror, behind, bounces=1), width=WIDTH, height=HEIGHT).of_pixel(
        CENTRE[1], CENTRE[0]
    )

    # light straight to the wall (1 m) or over the mirror (5 m); camera over the mirror (5 m)
    assert delay_s * C == pytest.approx([1 + 5, 5 + 5])
    assert weight == pytest.approx([0.5, 0.5 * 0.5 / 25])


def test_a_stencil_casts_its_shape_as_a_shadow() -> None:
    """Halfway to the wall, the shadow is twice as large as the stencil."""
    opaque = np.array([[True, False], [False, False]])
    stencil = surface("stencil", v(0.5, 1.0, 0.0), v(0, -1, 0), (0.2, 0.2), opaque=opaque)
    lamp = v(0.5, 0, 0)

    responses = trace(scene(WALL, stencil, light=lamp), width=WIDTH, height=HEIGHT)
    dark = responses.returns()[1].sum(axis=0) == 0

    points = pixel_points(2.0)
    x, z = points[..., 0], points[..., 2]
    shadow = (x > 0.3) & (x < 0.5) & (z > 0.0) & (z < 0.2)  # the upper left quarter
    hidden = (x / 2 > 0.4) & (x / 2 < 0.5) & (z / 2 > 0.0) & (z / 2 < 0.1)  # behind it
    assert shadow.any()
    assert (dark == (shadow | hidden)).all()


def test_a_wall_in_between_casts_a_shadow() -> None:
    plate = surface("diffuse", v(1.0, 1.0, 0), v(0, 1, 0), (0.5, 0.5))

    _, weight = trace(scene(WALL, plate, light=v(2.0, 0, 0)), width=WIDTH, height=HEIGHT).returns()

    points = pixel_points(2.0)
    halfway_x = (points[..., 0] + 2.0) / 2
    shadow = (np.abs(halfway_x - 1.0) < 0.25) & (np.abs(points[..., 2] / 2) < 0.25)
    assert shadow.any()
    assert ((weight.sum(axis=0) == 0) == shadow).all()


def test_the_nearer_surface_hides_the_farther_one() -> None:
    near = surface("diffuse", v(0, 1, 0), v(0, -1, 0), (0.1, 0.1))

    delay_s, _ = trace(scene(WALL, near), width=WIDTH, height=HEIGHT).returns()

    assert delay_s[0][CENTRE] * C == pytest.approx(2.0)
    assert delay_s[0][0, 0] * C > 4.0


def test_a_camera_that_sees_nothing_gives_no_light() -> None:
    empty = trace(scene(WALL, look_at=v(0, -1, 0)), width=WIDTH, height=HEIGHT)

    assert not empty.moments(0.0).any()
    assert np.isnan(empty.returns()[0]).all()


def test_columns_run_to_the_right_and_rows_down() -> None:
    patch = surface("diffuse", v(0.5, 2, 0.3), v(0, -1, 0), (0.1, 0.1))

    rows, columns = np.nonzero(trace(scene(patch), width=WIDTH, height=HEIGHT).moments(0.0))

    assert columns.min() > WIDTH // 2
    assert rows.max() < HEIGHT // 2


class TestMirrors:
    """The built-in scene of Fig. 1."""

    def test_three_returns_at_the_papers_times_of_flight(self) -> None:
        responses = trace(find_scene("mirrors"), width=163, height=120)

        delay_s, weight = responses.returns()

        assert delay_s[:, 60, 81] * 1e9 == pytest.approx([11.3, 19.3, 26.7], abs=0.05)
        assert ((weight > 0).sum(axis=0) == 3).mean() > 0.7
        assert ((weight > 0).sum(axis=0) >= 1).all()
        assert np.nanmax(delay_s) < 1 / 23e6

    def test_each_digit_shadows_the_return_of_its_path(self) -> None:
        with_stencils = find_scene("mirrors")
        without = replace(
            with_stencils, surfaces=tuple(s for s in with_stencils.surfaces if s.kind != "stencil")
        )
        for path, (name, column) in enumerate((("1", 130), ("2", 80), ("3", 28))):
            alone = replace(
                without,
                surfaces=(
                    *without.surfaces,
                    *(s for s in with_stencils.surfaces if s.name == f"stencil {name}"),
                ),
            )
            lost = (
                trace(without, width=163, height=120).moments(0.0)
                - trace(alone, width=163, height=120).moments(0.0)
            ).real
            mask = next(s for s in alone.surfaces if s.name == f"stencil {name}").opaque
            assert mask is not None
            rows, columns = np.nonzero(lost > 0)
            box = lost[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
            assert columns.mean() == pytest.approx(column, abs=12)
            # the shadow, shrunk to the mask's size, is the mask
            centre_row = ((np.arange(mask.shape[0]) + 0.5) * box.shape[0] / mask.shape[0]).astype(
                int
            )
            centre_column = (
                (np.arange(mask.shape[1]) + 0.5) * box.shape[1] / mask.shape[1]
            ).astype(int)
            assert ((box[np.ix_(centre_row, centre_column)] > 0) == mask).all(), path


def test_a_lens_shows_points_where_browns_model_says() -> None:
    """Rays through places on the sensor, projected again by the model itself."""
    lens = Lens((-0.12, 0.03, 0.002, -0.001, 0.01), (0.02, -0.01))
    view = Viewpoint(np.zeros(3), np.array([0.0, 1.0, 0.0]), 70.0, lens)
    rows, columns = np.divmod(np.arange(41 * 31), 41)

    rays = rays_through(view, columns, rows, width=41, height=31)

    x, y = rays[:, 0] / rays[:, 1], rays[:, 2] / rays[:, 1]
    k1, k2, p1, p2, k3 = lens.distortion
    squared = x * x + y * y
    radial = 1 + k1 * squared + k2 * squared**2 + k3 * squared**3
    half = math.tan(math.radians(35))
    seen_x = x * radial + 2 * p1 * x * y + p2 * (squared + 2 * x * x) + 2 * half * 0.02
    seen_y = y * radial + p1 * (squared + 2 * y * y) + 2 * p2 * x * y + 2 * half * 0.01
    assert seen_x == pytest.approx(half * (2 * (columns + 0.5) / 41 - 1), abs=1e-6)
    assert seen_y == pytest.approx(half * 31 / 41 * (1 - 2 * (rows + 0.5) / 31), abs=1e-6)


def test_gloss_is_a_lobe_around_the_direction_of_reflection() -> None:
    """On a wall seen from the lamp's own place, the highlight is straight ahead."""
    wall = Rectangle.facing(np.array([0.0, 2.0, 0.0]), np.array([0.0, -1.0, 0.0]), size=(3, 3))
    eye = np.zeros(3)
    directions = np.array([[0.0, 1.0, 0.0], [0.3, 1.0, 0.0]])
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    weights = []
    for gloss in (0.0, 0.2):
        surface = Surface("wall", "diffuse", wall, 0.5, gloss=gloss, gloss_exponent=40.0)
        of = Scene(
            name="test",
            description="",
            file=None,
            light=Light(1.0, eye, np.array([0.0, 1.0, 0.0]), 0.0),
            camera=Viewpoint(eye, np.array([0.0, 1.0, 0.0]), 40.0),
            surfaces=(surface,),
        )
        weights.append(light_rays(of, directions).weight[0])

    cosine = directions[:, 1]
    expected = 0.2 * (40 + 8) / 8 * cosine**40 * cosine / (2 / cosine) ** 2
    assert weights[1] - weights[0] == pytest.approx(expected, rel=1e-9)


def test_chains_of_mirrors_that_are_left_out_light_nothing() -> None:
    random = np.random.default_rng(1)
    left_out = 0
    for _ in range(20):
        mirrors = tuple(
            surface("mirror", random.uniform(-2, 2, 3), random.normal(size=3), size=(1.2, 0.8))
            for _ in range(3)
        )
        of = scene(*mirrors, light=random.uniform(-1, 1, 3))
        point, towards = random.uniform(-4, 4, (2, 5_000, 3))
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        found = {tuple(map(id, light.mirrors)): light for light in image_lights(of)}

        for last, further in itertools.permutations(mirrors, 2):
            before = found.get((id(last),))
            if before is None or not further.mirror.in_front(before.positions_m[0]):
                continue
            if (id(further), id(last)) not in found:
                image_m = further.mirror.mirrored(before.positions_m[0])
                axis = further.mirror.mirrored_direction(before.axis)
                chain = ImageLight((further, last), (image_m, *before.positions_m), axis)
                assert not light_on(of, chain, point, towards)[1].any()
                left_out += 1
    assert left_out > 10


def test_rays_are_followed_the_same_in_any_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    of = find_scene("mirrors")
    assert isinstance(of, Scene)
    assert of.camera is not None
    random = np.random.default_rng(1)
    place = random.uniform(0, [[WIDTH], [HEIGHT]], (2, 1000))
    directions = rays_through(of.camera, *place, width=WIDTH, height=HEIGHT)
    whole = light_rays(of, directions)

    monkeypatch.setattr(paths, "_BLOCK", 70)
    in_blocks = light_rays(of, directions)

    assert (whole.weight[1:] > 0).any()
    for name in Lit.__slots__:
        assert np.array_equal(getattr(in_blocks, name), getattr(whole, name))


def test_no_rays_see_no_light() -> None:
    of = find_scene("mirrors")
    assert isinstance(of, Scene)

    assert light_rays(of, np.zeros((0, 3))).surface.size == 0
