"""What pixels see, lit or not, against a ray caster that shares no text with the simulation."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_simulation
from transientcam_driver import Truth, list_scenes
from transientcam_driver.camera import SurfaceSeen
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.emulated._build import scenery_of
from transientcam_simulation.light import LightRequirements

WIDTH, HEIGHT = 23, 17
NEAREST_M = 1e-7
BUILT_IN = [info.name for info in list_scenes() if info.name not in ("measured", "calibration")]
FOLDER = Path(transientcam_simulation.__file__).parent / "scenes"
Array = NDArray[np.float64]


def seen(scene: str, time_s: float = 0.0) -> SurfaceSeen:
    """What is seen by direct light alone, over no mirror: geometry is the same with more."""
    scenery = scenery_of(find_scene(scene), width=WIDTH, height=HEIGHT)
    surface = scenery.view(LightRequirements()).surface
    assert surface is not None
    return surface(time_s)


def unit(vector: Any) -> Array:
    found: Array = np.array(vector, dtype=float)
    return found / math.sqrt(float(found @ found))


def rectangle_axes(normal: Array) -> tuple[Array, Array]:
    """Directions of width and height: level, and across."""
    level = (1.0, 0.0, 0.0) if abs(normal[2]) > 0.999 else np.cross((0.0, 0.0, 1.0), normal)
    across = unit(level)
    return across, np.cross(normal, across)


def meets(surface: dict[str, Any], start: Array, way: Array) -> tuple[float, Array] | None:
    """How far along a way a surface is met, and its normal there; None where it is not."""
    centre = np.array(surface["centre_m"], dtype=float)
    if surface.get("shape", "rectangle") == "rectangle":
        normal = unit(surface["normal"])
        slope = float(way @ normal)
        if slope == 0.0:
            return None
        reach = float((centre - start) @ normal) / slope
        place = start + reach * way - centre
        half = np.array(surface["size_m"], dtype=float) / 2
        inside = all(abs(place @ a) <= h for a, h in zip(rectangle_axes(normal), half, strict=True))
        return (reach, normal) if reach > NEAREST_M and inside else None
    radii = np.array(surface.get("radii_m", [surface.get("radius_m", 0.0)] * 3), dtype=float)
    seen, along = (start - centre) / radii, way / radii
    square, middle = float(along @ along), float(along @ seen)
    root = middle**2 - square * (float(seen @ seen) - 1.0)
    if root <= 0.0:
        return None
    reach = (-middle - math.sqrt(root)) / square
    place = start + reach * way - centre
    return (reach, unit(place / radii**2)) if reach > NEAREST_M else None


def cast(text: str) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Range of what each pixel's centre sees, whether the lamp sees it, and whether it mirrors."""
    scene = tomllib.loads(text)
    camera: dict[str, Any] = {
        "position_m": [0, 0, 0],
        "look_at_m": [0, 1, 0],
        "field_of_view_deg": 45.0,
    }
    camera |= scene["camera"]
    eye = np.array(camera["position_m"], dtype=float)
    lamp = np.array(scene["light"]["position_m"], dtype=float)
    ahead = unit(np.array(camera["look_at_m"], dtype=float) - eye)
    right = unit(np.cross(ahead, (0.0, 0.0, 1.0)))
    upwards = np.cross(right, ahead)
    slope = math.tan(math.radians(camera["field_of_view_deg"] / 2)) / (WIDTH / 2)
    # panes are an effect, and are not there without it
    surfaces = [each for each in scene["surface"] if each["kind"] not in ("stencil", "glass")]
    range_m = np.full((HEIGHT, WIDTH), np.nan)
    lit, mirrors = np.zeros((2, HEIGHT, WIDTH), dtype=bool)
    for row in range(HEIGHT):
        for column in range(WIDTH):
            x, y = column - (WIDTH - 1) / 2, (HEIGHT - 1) / 2 - row
            way = unit(ahead + slope * (x * right + y * upwards))
            met = [(meets(each, eye, way), each) for each in surfaces]
            there = [(hit, each) for hit, each in met if hit is not None]
            if not there:
                continue
            (reach, normal), surface = min(there, key=lambda each: each[0][0])
            if normal @ way >= 0:
                continue
            point = eye + reach * way
            to_lamp = lamp - point
            apart = math.sqrt(float(to_lamp @ to_lamp))
            range_m[row, column] = (reach + apart) / 2
            mirrors[row, column] = surface["kind"] == "mirror"
            away = point + 1e-6 * normal
            between = (meets(each, away, to_lamp / apart) for each in surfaces)
            lit[row, column] = normal @ to_lamp > 0 and not any(
                hit is not None and hit[0] < apart - 1e-5 for hit in between
            )
    return range_m, lit, mirrors


def require_agreement(name: str, text: str, truth: SurfaceSeen) -> None:
    range_m, lit, mirrors = cast(text)
    kept = np.isfinite(truth.range_m)
    stencils = 'kind = "stencil"' in text  # whose masks the caster does not know
    assert stencils or (kept == np.isfinite(range_m)).all(), name
    assert kept.any()
    np.testing.assert_allclose(truth.range_m[kept], range_m[kept], rtol=0, atol=1e-6)
    direct = truth.direct_share > 0
    if not stencils:
        assert (direct == (lit & ~mirrors)).mean() > 0.998
    assert not direct[mirrors | ~kept].any()
    assert (truth.direct_share <= 1).all()


def still(text: str) -> bool:
    return "motion" not in text


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_surface_of_each_built_in_scene_is_that_of_a_ray_caster(name: str) -> None:
    text = (FOLDER / f"{name}.toml").read_text()
    if still(text):
        require_agreement(name, text, seen(name))


def test_scenes_of_others_agree_too(data_dir: Path) -> None:
    files = sorted((data_dir / "scenes").glob("*.toml"))
    texts = {each: each.read_text() for each in files}
    for file in (each for each, text in texts.items() if still(text)):
        require_agreement(file.stem, texts[file], seen(str(file)))


def test_the_far_side_of_the_corner_has_a_surface_and_no_direct_light() -> None:
    truth = seen("corner-left")

    unlit = truth.direct_share == 0

    assert 0.42 < unlit.mean() < 0.52
    assert np.isfinite(truth.range_m[unlit]).all()


def test_what_moves_is_where_it_is_at_that_time(tmp_path: Path) -> None:
    text = """
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 2.0, 0.0]
[light]
position_m = [0.1, 0.0, 0.0]
aim_at_m = [0.0, 2.0, 0.0]
electrons_per_s = 3e7
[[motion]]
name = "nearer"
path_m = [[0.0, 0.0, 0.0], [0.0, -0.4, 0.0]]
period_s = 2.0
repeat = "back"
[[surface]]
kind = "diffuse"
centre_m = [0.0, 2.0, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [9.0, 9.0]
albedo = 0.5
[[surface]]
kind = "diffuse"
shape = "sphere"
centre_m = [0.0, 1.5, 0.0]
radius_m = 0.3
albedo = 0.5
motion = "nearer"
"""
    path = tmp_path / "nearer.toml"
    path.write_text(text)

    begins, later = (seen(str(path), time_s).range_m for time_s in (0.0, 0.5))

    middle = HEIGHT // 2, WIDTH // 2
    assert 0.1 < begins[middle] - later[middle] < 0.4
    assert begins[0, 0] == later[0, 0]


def test_responses_from_files_have_no_surface() -> None:
    truth = Truth(
        np.full((1, 2, 3), 1e-8),
        np.ones((1, 2, 3)),
        "dense",
        lambda x, y: (np.zeros(1), np.zeros(1)),
        1.0,
    )

    assert np.isnan(truth.direct_share).all()
    np.testing.assert_array_equal(truth.range_m, truth.first_return_m)
