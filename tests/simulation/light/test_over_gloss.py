"""What glossy surfaces show and light, against a path tracer that shares no code, and mirrors."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulation.path_tracer import REPETITIONS, Tracer
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._facts import SceneFacts
from transientcam_simulation.light._over_gloss import Glow, ShownByGloss
from transientcam_simulation.light._paths import light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Points, Rectangle, Scene, parse_scene

SIZE = 163, 120
PIXEL = np.arange(300, 163 * 120, 1100)
F_HZ = 69e6


def room(floor: str) -> Scene:
    """A wall, a floor before it that shows the wall and shines on it, and a ball."""
    return parse_scene(f"""
        name = "a test's"
        [camera]
        look_at_m = [0.0, 2.0, -0.3]
        field_of_view_deg = 40.0
        [light]
        position_m = [0.05, 0.0, 0.1]
        aim_at_m = [0.0, 2.0, 0.0]
        electrons_per_s = 6e7
        [transport]
        patches = 16
        [[surface]]
        kind = "diffuse"
        centre_m = [0.0, 2.2, 0.0]
        normal = [0.0, -1.0, 0.0]
        size_m = [4.0, 1.4]
        albedo = 0.7
        [[surface]]
        centre_m = [0.0, 1.2, -0.7]
        normal = [0.0, 0.0, 1.0]
        size_m = [4.0, 2.0]
        {floor}
        [[surface]]
        kind = "diffuse"
        shape = "sphere"
        centre_m = [0.3, 1.6, -0.5]
        radius_m = 0.1
        albedo = 0.4
        gloss = 0.3""")


@pytest.mark.parametrize(("gloss", "exponent"), [(0.6, 30), (0.3, 400)])
def test_light_by_gloss_is_what_a_path_tracer_finds(gloss: float, exponent: float) -> None:
    scene = room(f'kind = "diffuse"\nalbedo = 0.1\ngloss = {gloss}\ngloss_exponent = {exponent}')
    assert scene.camera is not None
    rows, columns = np.divmod(PIXEL, SIZE[0])
    rays = rays_through(scene.camera, columns, rows, width=SIZE[0], height=SIZE[1])
    lit = light_rays(scene, rays)

    def by(exchange: Exchange, rays: Points | None) -> NDArray[np.complex128]:
        light = Interreflection(scene, lit, width=len(rows), height=1, exchange=exchange, rays=rays)
        moments: NDArray[np.complex128] = lit.moments(F_HZ, None) + light.moments(F_HZ).ravel()
        return moments

    found = by(Exchange.of(scene, 16, mirrors=True), rays)
    traced = Tracer(scene, SIZE).moments(PIXEL, np.array([F_HZ]), paths=512)[:, 0]
    expected = traced.mean(axis=0)
    error = np.sqrt(np.var(traced, axis=0, ddof=1) / REPETITIONS)
    # pixels that an edge crosses are means over their areas, of which one ray knows nothing
    apart = np.abs(found - expected) - 3 * error
    smooth = np.argsort(apart)[: len(PIXEL) * 9 // 10]
    size = np.abs(expected[smooth])
    assert np.median(apart[smooth] / size) < 0.005
    assert (apart[smooth] < 0.04 * size).all()
    without = np.abs(by(Exchange.of(scene, 16), None) - expected)[smooth]
    assert np.linalg.norm(np.abs(found - expected)[smooth]) < 0.2 * np.linalg.norm(without)


def test_a_very_sharp_lobe_glows_as_a_mirror_shows_the_lamp() -> None:
    scene = room('kind = "diffuse"\nalbedo = 0.0\ngloss = 0.5\ngloss_exponent = 9000')
    patches = Exchange.of(scene, 8).patches

    glow = Glow.of(scene, patches).irradiance(0.0, len(patches)).real

    wall = np.flatnonzero(patches.surface == 0)
    image = scene.surfaces[1].mirror.mirrored(scene.light.position_m)
    way = patches.centre[wall] - image
    far_m = np.linalg.norm(way, axis=1)
    floor = way[:, 2] / far_m  # cosine to the floor's normal
    lobe = 0.5 * (9008 / 9002) * floor**2
    expected = lobe * way[:, 1] / far_m**3
    shown = image[:2] + way[:, :2] * (-0.7 - image[2]) / way[:, 2:]
    shape = scene.surfaces[1].shape
    assert isinstance(shape, Rectangle)
    clear = np.abs(shown - shape.centre[:2]).max(axis=1) < 0.8
    clear &= np.hypot(*(shown - [0.3, 1.6]).T) > 0.3
    assert clear.sum() > 5
    assert glow[wall][clear] == pytest.approx(expected[clear], rel=0.03)


def test_where_nothing_shines_gloss_shows_nothing() -> None:
    scene = room('kind = "diffuse"\nalbedo = 0.5')
    matt = replace(scene, surfaces=scene.surfaces[:2])
    assert ShownByGloss.of(matt, np.array([[0.0, 1.0, 0.0]]), 8) is None


def test_gloss_counts_by_what_it_shines_on_where_no_highlight_is_seen() -> None:
    scene = room('kind = "diffuse"\nalbedo = 0.0\ngloss = 0.5\ngloss_exponent = 200')
    assert scene.camera is not None
    up = replace(scene.camera, look_at_m=np.array([0.0, 2.0, 0.6]))
    seen = replace(scene, camera=up, surfaces=scene.surfaces[:2])
    facts = SceneFacts(seen, width=41, height=30)

    (change,) = facts.changes("gloss", (F_HZ,))
    (glimpse,) = facts.glimpses
    assert change.max() > 0.02 * glimpse.brightness.max()
