"""Where the pixels look, and by which source."""

import json
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from transientcam_driver import Lens, open_camera
from transientcam_server.imaging import Intrinsics, known_intrinsics
from transientcam_server.settings import LensSettings
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.light._rays import camera_rays

SIZE: dict[str, Any] = {"width": 163, "height": 120}
BENT = (0.1, -0.2, 0.01, 0.0, 0.0)
SCENE = Intrinsics.of_field(40.0, **SIZE, source="scene")


def test_points_lie_where_the_simulated_camera_looks() -> None:
    viewpoint = find_scene("mirrors").camera
    assert viewpoint is not None
    rays = camera_rays(viewpoint, **SIZE).reshape(120, 163, 3)
    forward = viewpoint.look_at_m - viewpoint.position_m
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])  # x right, y down, z forward

    points = Intrinsics.of_field(viewpoint.field_of_view_deg, **SIZE).points(np.ones((120, 163)))

    np.testing.assert_allclose(points, np.einsum("kc,yxc->kyx", axes, rays), atol=1e-6)


def test_a_point_is_as_far_away_as_its_range_says() -> None:
    range_m = np.random.default_rng(1).uniform(0.1, 6.0, (120, 163))
    range_m[3, 4] = np.nan
    odd = Intrinsics(200.0, 230.0, 70.0, 65.0, **SIZE)

    points = odd.points(range_m)

    np.testing.assert_allclose(np.linalg.norm(points, axis=0), range_m, rtol=1e-5)
    assert np.isnan(points[:, 3, 4]).all()
    # pixel by pixel, by the definition
    x, y, z = points[:, 100, 20]
    assert (x / z, y / z) == pytest.approx(((20 - 70.0) / 200.0, (100 - 65.0) / 230.0), rel=1e-5)


def test_half_the_field_of_view_is_at_the_edge_of_the_frame() -> None:
    lens = Intrinsics.of_field(90.0, width=101, height=51)

    assert (lens.cx, lens.cy) == (50.0, 25.0)
    # the edge is half a pixel beyond the centre of the last one
    assert (100.5 - lens.cx) / lens.fx == pytest.approx(1.0)
    assert lens.fx == lens.fy


def test_what_the_settings_say_goes_before_the_scene() -> None:
    given = LensSettings(field_of_view_deg=90.0)

    found = known_intrinsics(given, **SIZE, scene=Lens(1.0, 1.0, 0.0, 0.0, light_x_m=0.3))

    assert found == replace(Intrinsics.of_field(90.0, **SIZE, source="settings"), light_x_m=0.3)


def test_settings_state_all_that_a_lens_has_and_the_light_alone() -> None:
    bent = (0.1, -0.2, 0.001, 0.002, 0.05)
    reported = Lens(150.0, 150.0, 81.0, 59.5, bent, 0.045)
    given = LensSettings(fx_px=200.0, distortion=bent[::-1], light_y_m=0.1, light_z_m=-0.02)

    found = known_intrinsics(given, **SIZE, reported=reported)
    aside = known_intrinsics(LensSettings(light_x_m=0.2), **SIZE, reported=reported)

    assert (found.fx, found.distortion, found.source) == (200.0, bent[::-1], "settings")
    assert (found.light_x_m, found.light_y_m, found.light_z_m) == (0.045, 0.1, -0.02)
    assert (aside.fx, aside.distortion, aside.source) == (150.0, bent, "camera")
    assert (aside.light_x_m, aside.light_y_m) == (0.2, 0.0)


def test_a_lens_that_was_calibrated_is_given_in_pixels() -> None:
    found = known_intrinsics(LensSettings(fx_px=200.0, cy_px=61.5), **SIZE)

    assert found == Intrinsics(200.0, 200.0, 81.0, 61.5, 163, 120, "settings")


def test_a_scene_knows_the_field_of_view_of_its_camera() -> None:
    with open_camera("sim:mirrors?noise=off") as camera:
        assert camera.simulation is not None
        lens = camera.simulation.lens(**SIZE)

    found = known_intrinsics(LensSettings(), **SIZE, scene=lens)
    assert replace(found, light_x_m=0.0, light_z_m=0.0, beam=()) == SCENE
    assert (found.light_x_m, found.light_z_m) == pytest.approx((-0.6, 0.12), abs=0.05)


WALL = """name = "flat"
[camera]
position_m = [0.5, 0.2, 0.1]
look_at_m = [0.8, 2.2, 0.3]
field_of_view_deg = 60.0
lens = {k1 = -0.25, k2 = 0.1, p1 = 0.01, p2 = -0.02, k3 = -0.05, centre_x = 0.1, centre_y = -0.05}
[light]
position_m = [0.8, 0.1, 0.5]
aim_at_m = [0.8, 2.2, 0.3]
electrons_per_s = 5.0e7
[[surface]]
name = "wall"
kind = "diffuse"
centre_m = [0.0, 2.2, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [19.0, 19.0]
albedo = 0.8
"""


@pytest.mark.parametrize("choice", ["auto", "on", "off"])
def test_a_flat_wall_is_flat_through_any_lens_and_beside_any_light(choice: str) -> None:
    with open_camera("sim:wall?noise=off") as camera:
        simulation = camera.simulation
        assert simulation is not None
        simulation.change(definition=WALL, effects={"distortion": choice, "mixed-pixels": "off"})
        lens = simulation.lens(**SIZE)
        points = known_intrinsics(LensSettings(), **SIZE, scene=lens).points(
            simulation.truth().range_m
        )

    forward = np.array([0.3, 2.0, 0.2]) / np.linalg.norm([0.3, 2.0, 0.2])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    into_room = np.stack([right, np.cross(forward, right), forward])
    np.testing.assert_allclose(np.einsum("kyx,k->yx", points, into_room[:, 1]), 2.0, atol=2e-4)


def test_a_recording_says_what_was_known_when_it_was_made() -> None:
    found = known_intrinsics(LensSettings(), **SIZE, recorded=asdict(SCENE))

    assert asdict(found) == asdict(SCENE) | {"source": "recording"}


@pytest.mark.parametrize(
    "recorded", [None, {}, {**asdict(SCENE), "fx": 0.0}, {**asdict(SCENE), "fx": "wide"}, {"fx": 1}]
)
def test_without_anything_that_is_known_a_usual_field_of_view_is_assumed(
    recorded: dict[str, object] | None,
) -> None:
    found = known_intrinsics(LensSettings(), **SIZE, recorded=recorded)

    assert found == Intrinsics.of_field(45.0, **SIZE, source="assumed")


def test_a_camera_reports_its_lens_and_settings_go_before_it() -> None:
    lens = Lens(200.0, 210.0, 80.0, 60.0, (0.09, -0.27, 0.0, 0.0, 0.095), 0.045)

    found = known_intrinsics(
        LensSettings(), **SIZE, reported=lens, scene=Lens(1.0, 1.0, 0.0, 0.0, BENT, 0.05)
    )

    assert found.source == "camera"
    assert (found.fx, found.fy, found.cx, found.cy) == (200.0, 210.0, 80.0, 60.0)
    assert (found.distortion, found.light_x_m) == (BENT, 0.05)
    given = LensSettings(field_of_view_deg=90.0)
    assert known_intrinsics(given, **SIZE, reported=lens).source == "settings"
    assert replace(found, source="recording") == known_intrinsics(
        LensSettings(), **SIZE, recorded=json.loads(json.dumps(asdict(found)))
    )


@pytest.mark.parametrize("distortion", ["auto", "off"])
@pytest.mark.parametrize("device", ["kinect2", "tofcam660", "opt8241"])
def test_a_wall_is_flat_through_the_lens_that_an_emulated_device_states(
    device: str, distortion: str
) -> None:
    with open_camera(f"{device}:emulated?scene=wall&distortion={distortion}") as camera:
        size: Any = {"width": camera.capabilities.width, "height": camera.capabilities.height}
        assert camera.simulation is not None
        assert camera.factory is not None
        found = known_intrinsics(
            LensSettings(),
            **size,
            reported=camera.factory.lens,
            scene=camera.simulation.lens(**size),
        )
        points = found.points(camera.simulation.truth().range_m)

    assert found.source == "camera"
    assert any(found.distortion) == (distortion == "auto")
    assert np.ptp(points[2]) < 1e-4


def test_a_recorded_lens_with_part_of_a_distortion_is_not_used() -> None:
    document = asdict(SCENE) | {"distortion": [0.1, 0.2]}

    assert known_intrinsics(LensSettings(), **SIZE, recorded=document).source == "assumed"


def test_light_beside_the_lens_is_taken_into_account() -> None:
    lens = Lens(200.0, 200.0, 81.0, 59.5, (0.05, -0.1, 0.001, 0.002, 0.03), 0.045, -0.3, 0.1)
    intrinsics = Intrinsics.of_lens(lens, **SIZE, source="camera")
    x, y = lens.slopes(**SIZE)
    z = np.random.default_rng(2).uniform(0.2, 4.0, x.shape)
    points = np.stack([x * z, y * z, z])
    light = np.array([0.045, -0.3, 0.1])[:, None, None]
    path_m = np.linalg.norm(points, axis=0) + np.linalg.norm(points - light, axis=0)
    path_m[0, :2] = [0.04, np.nan]  # shorter than from the light to the lens

    found = intrinsics.points(path_m / 2)

    assert np.isnan(found[:, 0, :2]).all()
    np.testing.assert_allclose(found[:, 1:], points[:, 1:], rtol=1e-5, atol=1e-6)
