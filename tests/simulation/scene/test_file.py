from pathlib import Path

import numpy as np
import pytest

from transientcam_driver import SceneError, list_scenes
from transientcam_simulation.emulated import find_scene
from transientcam_simulation.scene import load_scene, parse_scene

SCENE = """
[light]
position_m = [0, 0, 0]
aim_at_m = [0, 1, 0]
electrons_per_s = 1e7

[[surface]]
kind = "diffuse"
centre_m = [0, 2, 0]
normal = [0, -1, 0]
size_m = [3, 2]
albedo = 0.5
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def test_a_scene_needs_a_light_and_a_surface_and_has_defaults_for_the_rest(tmp_path: Path) -> None:
    scene = load_scene(write(tmp_path, SCENE))

    assert scene.name == "scene"
    assert [surface.kind for surface in scene.surfaces] == ["diffuse"]
    assert (scene.seed, scene.mirror_bounces, scene.sensor.bits) == (1, 2, 12)
    assert set(scene.effects.values()) == {"auto"}


def test_a_mask_is_read_from_top_to_bottom(tmp_path: Path) -> None:
    stencil = """
[[surface]]
kind = "stencil"
centre_m = [0, 1, 0]
normal = [0, -1, 0]
size_m = [1, 1]
mask = '''
#..
.##
'''
"""
    scene = load_scene(write(tmp_path, SCENE + stencil))

    mask = scene.surfaces[1].opaque
    assert mask is not None
    assert mask.tolist() == [[True, False, False], [False, True, True]]


MOVED = """
motion = "to"
[[motion]]
name = "to"
path_m = [[0, 0, 0], [1, 0, 0]]
period_s = 2
[[surface]]
kind = "glass"
centre_m = [0, 1, 0]
normal = [0, -1, 0]
size_m = [1, 1]
"""

RIDES = MOVED[: MOVED.index("[[surface]]")]
FAST = RIDES.replace("period_s = 2", "period_s = 1e-6\nrotation_deg = [[0, 0, 0], [0, 0, 9e5]]")
NONE, SPUN = (RIDES.replace("path_m", key) for key in ("path", "rotation_deg"))
FLAT = SPUN.replace("1, 0, 0", "1, 0")
EGG = 'shape = "ellipsoid"\nradii_m = [1, 1, 2]\nalbedo = 0.5' + SPUN

ERRORS = [
    ("albedo = 0.5", "albedo = 1.5", "surface[0].albedo", 1.5, "at most 1"),
    ("albedo = 0.5", "", "surface[0].albedo", None, "present"),
    ("albedo = 0.5", "albedo = true", "surface[0].albedo", True, "a number"),
    ("albedo = 0.5", "albedo = 0.5\nshiny = 1", "surface[0].shiny", 1, "known here are"),
    ('"diffuse"', '"fog"', "surface[0].kind", "fog", "translucent, mirror, stencil, glass"),
    ('"diffuse"', '"glass"\nthickness_m = -1', "surface[0].thickness_m", -1, "of at least 0"),
    ('"diffuse"', '"glass"\nrefractive_index = 0.5', "surface[0].refractive_index", 0.5, "1 and"),
    ('"diffuse"', '"glass"\nreflectivity = 2', "surface[0].reflectivity", 2, "of at most 1"),
    ('"diffuse"', '"glass"\nshape = "sphere"', "surface[0].shape", "sphere", "of rectangle"),
    ('"diffuse"', '"glass"\ngloss = 0.1', "surface[0].gloss", 0.1, "known here are"),
    ('"diffuse"', '"glass"\nmotion = "to"', "surface[0].motion", ["to"], "a glass stays"),
    ("albedo = 0.5", "albedo = 0.5" + MOVED, "surface[1].kind", "glass", "something moves"),
    ("[light]", "[camera]" + MOVED + "albedo = 0.1\n[light]", "surface[0].kind", "glass", "moves"),
    ("[light]", "[camera]\nmotion = 'to'\n[light]", "camera.motion", "to", "none in this file"),
    ("[light]", "[light]\nmotion = 'to'", "light.motion", "to", "name of a [[motion]]"),
    ("albedo = 0.5", "albedo = 0.5" + FAST, "motion[0].period_s", 1e-6, "faster than light"),
    ("albedo = 0.5", "albedo = 0.5" + NONE, "motion[0].path_m", None, "present"),
    ("albedo = 0.5", "albedo = 0.5" + FLAT, "motion[0].rotation_deg", None, "3 numbers"),
    (SCENE[SCENE.index("normal") :], EGG, "surface[0].radii_m", [1, 1, 2], "along x, y and z"),
    ("[0, -1, 0]", "[0, 0, 0]", "surface[0].normal", [0, 0, 0], "other than zero"),
    ("[0, -1, 0]", "[0, -1]", "surface[0].normal", [0, -1], "a list of 3 numbers"),
    ("[0, -1, 0]", "[0, nan, 0]", "surface[0].normal", None, "a list of 3 numbers"),
    ("[3, 2]", "[3, -2]", "surface[0].size_m", [3, -2], "at least 1e-06 and of at most 1e+06"),
    ("electrons_per_s = 1e7", "electrons_per_s = 0", "light.electrons_per_s", 0, "at least 1e-09"),
    ("[0, -1, 0]", "[0, 1e-308, 0]", "surface[0].normal", [0, 0, 0], "other than zero"),
    ("[0, 1, 0]", "[0, 1e308, 0]", "light.aim_at_m", [0, 1e308, 0], "from -1e+06 to 1e+06"),
    ("electrons_per_s = 1e7", "electrons_per_s = inf", "light.electrons_per_s", None, "a number"),
    ("aim_at_m = [0, 1, 0]", "aim_at_m = [0, 0, 0]", "light.aim_at_m", [0, 0, 0], "away from"),
    ("[light]", "[light]\ncolour = 1", "light.colour", 1, "absent"),
    ("[light]", "[sensor]\nbits = 20\n[light]", "sensor.bits", 20, "from 1 to 16"),
    ("[light]", "[sensor]\nbits = 4\n[light]", "sensor.dark_dn", 64.0, "at most 15"),
    ("[light]", "[effects]\nshot-noise = 1\n[light]", "effects.shot-noise", 1, "auto, on, off"),
    ("[light]", "[effects]\nfog = 'on'\n[light]", "effects.fog", "on", "shot-noise, read-noise"),
    ("[light]", "[transport]\nmirror_bounces = 9\n[light]", "transport.mirror_bounces", 9, "to 8"),
    ("[light]", "[camera]\nlook_at_m = [0, 0, 5]\n[light]", "camera.look_at_m", None, "above or"),
    ("[light]", "seed = -1\n[light]", "seed", -1, "an integer from 0"),
    ("[light]", "name = 5\n[light]", "name", 5, "a text"),
    ("[light]", "mood = 'dark'\n[light]", "mood", "dark", "absent"),
    ("[[surface]]", "[surface]", "surface", None, "written [[surface]]"),
    ("[light]", "[light", "the file", None, "valid TOML"),
    ("[light]", "[[response]]\nfile = 'x.npz'\n[light]", "surface", 1, "only one of them"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "key", "value", "allowed"), ERRORS)
def test_an_error_names_file_key_value_and_what_is_allowed(
    tmp_path: Path, old: str, new: str, key: str, value: object, allowed: str
) -> None:
    assert old in SCENE
    path = write(tmp_path, SCENE.replace(old, new, 1))

    with pytest.raises(SceneError) as caught:
        load_scene(path)

    error = caught.value
    assert (error.file, error.key) == (str(path), key)
    assert value is None or error.value == value
    assert allowed in error.allowed
    assert all(part in str(error) for part in (str(path), key, error.allowed))


@pytest.mark.parametrize("mask", ["", "#.\n#", "#x", "  \n  "])
def test_a_mask_of_other_signs_or_uneven_rows_is_refused(tmp_path: Path, mask: str) -> None:
    stencil = SCENE.replace('kind = "diffuse"', 'kind = "stencil"').replace(
        "albedo = 0.5", f"mask = '''\n{mask}\n'''"
    )

    with pytest.raises(SceneError, match="rows of equal length"):
        load_scene(write(tmp_path, stencil))


def test_an_empty_scene_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"surface = 0"):
        load_scene(write(tmp_path, "name = 'nothing'"))


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="No such file"):
        load_scene(tmp_path / "absent.toml")


def test_the_built_in_scenes_are_listed_with_a_sentence_each() -> None:
    infos = list_scenes()

    assert [info.name for info in infos] == [
        "calibration",
        "cornell",
        "corner",
        "corner-left",
        "hall",
        "measured",
        "mirrors",
        "pane",
        "translucent",
        "visitor",
        "wall",
    ]
    assert all(info.description and info.path.is_file() for info in infos)


def test_a_scene_is_found_by_name_or_by_path(tmp_path: Path) -> None:
    assert find_scene("mirrors").name == "mirrors"
    assert find_scene(str(write(tmp_path, SCENE))).name == "scene"


def test_an_unknown_scene_names_the_known_ones() -> None:
    with pytest.raises(SceneError, match=r"translucent, visitor, wall, measured:PATH.npz"):
        find_scene("mirror")


def test_the_directions_of_a_rectangle_are_those_of_a_viewer_in_front() -> None:
    wall = find_scene("mirrors").surfaces[0].mirror

    assert np.allclose(wall.right, [1, 0, 0])
    assert np.allclose(wall.up, [0, 0, 1])


def test_a_scene_that_is_sent_is_that_of_the_same_text_in_a_file(tmp_path: Path) -> None:
    sent, read = parse_scene(SCENE), load_scene(write(tmp_path, SCENE))

    assert (sent.name, sent.file) == ("own scene", None)
    assert [each.name for each in sent.surfaces] == [each.name for each in read.surfaces]
    assert sent.light.electrons_per_s == read.light.electrons_per_s


MIRROR = """
[[surface]]
kind = "mirror"
centre_m = [1, 1, 0]
normal = [-1, 0, 0]
size_m = [1, 1]
reflectivity = 0.9
"""
WALL = SCENE[SCENE.index("[[surface]]") :]


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("scene = [", "the text"),
        ("a = " + "[" * 5000, "the text"),
        ("seed = " + "9" * 5000, "the text"),
        (SCENE.replace("1e7", "0x" + "f" * 5000), "light.electrons_per_s"),
        (SCENE.replace("1e7", "9" * 400), "light.electrons_per_s"),
        (SCENE.replace("[3, 2]", f"[3, {'9' * 400}]"), "surface[0].size_m"),
        ('name = "mirrors"\n' + SCENE, "name"),
        ('[light]\nelectrons_per_s = 1e7\n[[response]]\nfile = "/etc/passwd"', "response[0].file"),
        (SCENE + '[device]\nwaveform_file = "/dev/zero"', "device.waveform_file"),
        (SCENE + '[device.pattern]\nfile = "/dev/zero"', "device.pattern.file"),
        (SCENE + 32 * WALL, "surface"),
        (SCENE + 9 * MIRROR, "transport.mirror_bounces"),
        (SCENE + 2 * MIRROR + "[transport]\nmirror_bounces = 8", None),
        (SCENE + 10 * WALL, "transport.patches"),
        (SCENE + 10 * WALL + "[transport]\ndiffuse_bounces = 0", None),
        (SCENE + 9 * WALL, None),  # 10 of 24 x 16 are 3840
    ],
)
def test_a_scene_that_is_sent_names_no_files_and_costs_no_more_than_it_may(
    text: str, key: str | None
) -> None:
    if key is None:
        parse_scene(text)
        return
    with pytest.raises(SceneError) as refused:
        parse_scene(text)

    assert refused.value.key == key


@pytest.mark.parametrize("spelling", ["diffuser", "diffusor"])
def test_a_diffuser_may_be_spelt_as_it_was_before(spelling: str) -> None:
    scene = parse_scene(f"[light]\nelectrons_per_s = 1\n[{spelling}]\nfall_off = 0.25\n")

    assert scene.diffuser is not None
    assert scene.diffuser.fall_off == 0.25
