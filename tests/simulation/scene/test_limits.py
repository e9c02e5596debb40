"""What scenes cost, counted before it is built; and numbers that nobody meant."""

import copy
import itertools
import json
import tomllib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from transientcam_driver import SceneError, Sequence
from transientcam_simulation.base import giving_up_by
from transientcam_simulation.emulated._build import world_of
from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Patches
from transientcam_simulation.scene import Scene, list_scenes, parse_scene
from transientcam_simulation.scene._limits import MOST_PATCHES, patches_of

EVERYTHING = """
seed = 3
[light]
electrons_per_s = 6e6
position_m = [0.1, 0, 0]
aim_at_m = [0, 2, 0]
beam_exponent = 2.0
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 1.0, 0.0]
field_of_view_deg = 45.0
[camera.lens]
k1 = 0.01
k2 = 0.01
p1 = 0.001
p2 = 0.001
centre_x = 0.01
centre_y = 0.01
vignetting = 1.0
[sensor]
full_well_e = 1e5
gain_e_per_dn = 2.0
read_noise_e = 20.0
bits = 16
dark_dn = 100.0
[device]
profile = "ideal"
seed = 4
dark_current_e_per_s = 100.0
outlier_share = 0.01
ghost = 0.01
crosstalk = 0.02
blooming = 0.3
non_linearity = 0.02
[device.pattern]
delay_s = 1e-10
gain = 0.01
[device.drift]
rise_c = 10.0
time_constant_s = 100.0
delay_s_per_c = 1e-12
[device.lens_scatter]
share = 0.05
width = 0.15
[device.jitter]
delay_s = 1e-11
power = 0.01
[device.hot_pixels]
share = 0.01
electrons_per_s = 1e5
[device.noisy_pixels]
share = 0.01
electrons = 100.0
[transport]
mirror_bounces = 1
diffuse_bounces = 1
patches = 3
[ambient]
electrons_per_s = 1000.0
flicker = 0.3
flicker_hz = 100.0
camera_electrons_per_s = 500.0
camera_hz = 23e6
[[surface]]
kind = "diffuse"
shape = "sphere"
centre_m = [-0.6, 3.0, 0.0]
radius_m = 0.5
albedo = 0.5
gloss = 0.2
gloss_exponent = 20.0
[[surface]]
kind = "translucent"
shape = "ellipsoid"
centre_m = [0.6, 3.0, 0.0]
radii_m = [0.5, 0.4, 0.3]
albedo = 0.5
scatter_width_s = 1e-10
scatter_decay_s = 1e-9
[[surface]]
kind = "diffuse"
centre_m = [0.0, 4.0, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [4.0, 3.0]
albedo = 0.8
[[surface]]
kind = "mirror"
centre_m = [1.5, 2.0, 0.0]
normal = [-1.0, 0.0, 0.0]
size_m = [2.0, 2.0]
reflectivity = 0.9
[[surface]]
kind = "stencil"
centre_m = [0.0, 2.0, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [0.5, 0.5]
mask = "#.\\n.#"
"""
DOCUMENT = tomllib.loads(EVERYTHING)
LIGHT = """
[light]
electrons_per_s = 6e6
position_m = [0.1, 0, 0]
aim_at_m = [0, 2, 0]
[camera]
"""
SPHERE = """
[[surface]]
kind = "diffuse"
shape = "sphere"
centre_m = [{}, 3, 0]
radius_m = 1
albedo = 0.9
"""


def written(value: Any) -> str:
    """Return a value as TOML has it, tables in line."""
    match value:
        case dict():
            return "{" + ", ".join(f"{key} = {written(each)}" for key, each in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(written, value)) + "]"
        case str() | bool():
            return json.dumps(value)
        case _:
            return repr(value)


def text_of(document: dict[str, Any]) -> str:
    return "\n".join(f"{key} = {written(each)}" for key, each in document.items())


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where numbers stand."""
    inside: Any = ()
    if isinstance(value, dict):
        inside = value.items()
    elif isinstance(value, list):
        inside = enumerate(value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path
    for key, each in inside:
        yield from places(each, (*path, key))


def with_number(document: dict[str, Any], path: tuple[Any, ...], number: float) -> str:
    document = copy.deepcopy(document)
    table: Any = document
    for key in path[:-1]:
        table = table[key]
    table[path[-1]] = number
    return text_of(document)


def parsed_or_refused(text: str) -> Scene | SceneError:
    try:
        return parse_scene(text)
    except SceneError as error:
        return error


def require_images(scene: Scene) -> None:
    """Capture images of a scene, without a number in them that is none."""
    sequence = Sequence(harmonics=1, exposure_s=0.0005)
    world = world_of(scene, width=8, height=6, readout_s=0.001)
    world.configure(sequence, sequence.labels)
    world.prepare()
    for number, time_s in ((1, 0.0), (2, 1e4)):
        label = sequence.labels[number]
        assert world.image(label, number=number, device_time_s=time_s).dtype == np.uint16
        mean_e = world.mean_image_e(label, number=number, device_time_s=time_s)
        assert np.isfinite(mean_e).all()
    json.dumps(world.explain("own").to_document(), allow_nan=False)


DOCUMENTS = {
    info.name: tomllib.loads(info.path.read_text()) | {"name": "changed"}
    for info in list_scenes()
    if info.name != "measured"  # which names files
} | {"everything": DOCUMENT}
CENTRE = ("surface", 2, "centre_m", 0)
ABSURD = (1e308, -1e308, 5e-324, -1e-308, 1e-30, 1e-12, 0.0, -1.0, 1e6, -1e6, 1e-6, 1e15, 2**63)
"""Where sums, squares and quotients leave what a float holds, and what is still allowed."""


@settings(max_examples=40, deadline=None)
@given(place=st.sampled_from(list(places(DOCUMENTS))), number=st.sampled_from(ABSURD))
@example(place=("everything", *CENTRE), number=1e308)
@example(place=("everything", *CENTRE), number=-1e6)
@example(place=("everything", "light", "electrons_per_s"), number=1e15)
@example(place=("everything", "surface", 0, "radius_m"), number=1e-6)
@example(place=("everything", "surface", 1, "radii_m", 2), number=1e6)
@example(place=("corner", "surface", 0, "centre_m", 0), number=1e6)
@example(place=("visitor", "motion", 0, "period_s"), number=1e-6)
def test_every_finite_number_works_or_is_refused_in_words(
    place: tuple[Any, ...], number: float
) -> None:
    """In every field of every built-in scene."""
    found = parsed_or_refused(with_number(DOCUMENTS[place[0]], place[1:], number))
    if isinstance(found, SceneError):
        assert found.key
        assert found.allowed
    elif place[0] == "everything":  # what else is taken has the same fields, and more patches
        require_images(found)


@pytest.mark.parametrize("name", DOCUMENTS)
def test_no_field_takes_a_number_beyond_all_bounds(name: str) -> None:
    for place, number in zip(
        places(DOCUMENTS[name]), itertools.cycle((1e308, -1e308)), strict=False
    ):
        found = parsed_or_refused(with_number(DOCUMENTS[name], place, number))
        assert isinstance(found, SceneError), place
        assert found.value is not None


def test_nothing_moves_faster_than_light() -> None:
    quick = tomllib.loads(with_number(DOCUMENTS["visitor"], ("motion", 0, "period_s"), 1e-6))
    fast = with_number(quick, ("motion", 0, "path_m", 0, 0), 1e3)
    with pytest.raises(SceneError, match=r"motion\[0\].period_s"):
        parse_scene(fast)


@pytest.mark.parametrize(
    ("surfaces", "per_side"),
    [
        (SPHERE.format(0), 2),
        (SPHERE.format(-1.2) + SPHERE.format(1.2), 6),
        (SPHERE.format(0).replace("radius_m = 1", "radius_m = 1e-6") + SPHERE.format(5), 7),
        (
            SPHERE.format(0)
            .replace("sphere", "ellipsoid")
            .replace("radius_m = 1", "radii_m = [3, 1e-3, 0.2]"),
            13,
        ),
        (EVERYTHING[EVERYTHING.index("[[surface]]") :], 9),
    ],
)
def test_as_many_patches_are_built_as_were_counted(surfaces: str, per_side: int) -> None:
    scene = parse_scene(f"{LIGHT}\n[transport]\npatches = {per_side}\n{surfaces}")

    built = Exchange.of(scene, per_side)

    assert len(built.patches) == patches_of(scene, per_side)
    assert built.factors.shape == built.distance_m.shape == (len(built.patches),) * 2


size_m = st.floats(1e-6, 1e6)


@given(
    radii_m=st.lists(st.tuples(size_m, size_m, size_m), min_size=1, max_size=3),
    per_side=st.integers(2, 64),
)
def test_no_shape_has_more_patches_than_were_counted_nor_more_than_may_be(
    radii_m: list[tuple[float, float, float]], per_side: int
) -> None:
    surfaces = "".join(
        SPHERE.format(0)
        .replace("sphere", "ellipsoid")
        .replace("radius_m = 1", f"radii_m = {list(each)}")
        for each in radii_m
    )
    found = parsed_or_refused(f"{LIGHT}\n[transport]\npatches = {per_side}\n{surfaces}")
    if isinstance(found, SceneError):
        assert found.key == "transport.patches"
    else:
        assert len(Patches.of(found, per_side)) == patches_of(found, per_side) <= MOST_PATCHES


def test_two_spheres_that_would_take_gigabytes_are_refused_by_key_and_limit() -> None:
    spheres = SPHERE.format(-1.2) + SPHERE.format(1.2)
    with pytest.raises(SceneError) as refused:
        parse_scene(f"{LIGHT}\n[transport]\npatches = 45\ndiffuse_bounces = 8\n{spheres}")

    assert (refused.value.key, refused.value.value) == ("transport.patches", 45)
    assert "20022 patches are more than 4096" in refused.value.allowed
    most = int(refused.value.allowed.split()[2])
    parse_scene(f"{LIGHT}\n[transport]\npatches = {most}\n{spheres}")
    with pytest.raises(SceneError):
        parse_scene(f"{LIGHT}\n[transport]\npatches = {most + 1}\n{spheres}")


def test_what_is_built_is_given_up_between_any_two_steps() -> None:
    scene = parse_scene(EVERYTHING)

    class GivenUp(Exception):  # noqa: N818 - no error
        pass

    def ask_until(step: int) -> Iterator[None]:
        yield from itertools.repeat(None, step)
        raise GivenUp

    asked = itertools.count()
    with giving_up_by(lambda: next(asked)):
        require_images(scene)
    steps = next(asked)
    assert steps > 5
    for step in {0, 1, steps // 2, steps - 1}:
        fresh = parse_scene(EVERYTHING.replace("6e6", f"6.{step}e6"))
        with giving_up_by(ask_until(step).__next__), pytest.raises(GivenUp):
            require_images(fresh)
        require_images(fresh)  # of what was given up nothing is kept that is not whole
