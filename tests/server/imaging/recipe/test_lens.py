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

    found = known_intrinsics(given, **SIZE, scene_field_deg=40.0)

    assert found == Intrinsics.of_field(90.0, **SIZE, source="settings")


def test_a_lens_that_was_calibrated_is_given_in_pixels() -> None:
    found = known_intrinsics(LensSettings(fx_px=200.0, cy_px=61.5), **SIZE)

    assert found == Intrinsics(200.0, 200.0, 81.0, 61.5, 163, 120, "settings")


def test_a_scene_knows_the_field_of_view_of_its_camera() -> None:
    with open_camera("sim:mirrors?noise=off") as camera:
        assert camera.simulation is not None
        field_deg = camera.simulation.field_of_view_deg

    assert known_intrinsics(LensSettings(), **SIZE, scene_field_deg=field_deg) == SCENE


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

    found = known_intrinsics(LensSettings(), **SIZE, reported=lens, scene_field_deg=40.0)

    assert found.source == "camera"
    assert (found.fx, found.fy, found.cx, found.cy) == (200.0, 210.0, 80.0, 60.0)
    assert (found.distortion, found.light_x_m) == (lens.distortion, 0.045)
    given = LensSettings(field_of_view_deg=90.0)
    assert known_intrinsics(given, **SIZE, reported=lens).source == "settings"
    assert replace(found, source="recording") == known_intrinsics(
        LensSettings(), **SIZE, recorded=json.loads(json.dumps(asdict(found)))
    )


def test_a_recorded_lens_with_part_of_a_distortion_is_not_used() -> None:
    document = asdict(SCENE) | {"distortion": [0.1, 0.2]}

    assert known_intrinsics(LensSettings(), **SIZE, recorded=document).source == "assumed"


def test_light_beside_the_lens_is_taken_into_account() -> None:
    lens = Lens(200.0, 200.0, 81.0, 59.5, (0.05, -0.1, 0.001, 0.002, 0.03), 0.045)
    intrinsics = Intrinsics.of_lens(lens, **SIZE, source="camera")
    x, y = lens.slopes(**SIZE)
    z = np.random.default_rng(2).uniform(0.2, 4.0, x.shape)
    points = np.stack([x * z, y * z, z])
    light = np.array([0.045, 0.0, 0.0])[:, None, None]
    path_m = np.linalg.norm(points, axis=0) + np.linalg.norm(points - light, axis=0)
    path_m[0, :2] = [0.04, np.nan]  # shorter than from the light to the lens

    found = intrinsics.points(path_m / 2)

    assert np.isnan(found[:, 0, :2]).all()
    np.testing.assert_allclose(found[:, 1:], points[:, 1:], rtol=1e-5, atol=1e-6)
