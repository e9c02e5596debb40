"""Meshes from files: what they hold, in every format, and files that are broken or ask too much."""

import json
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from transientcam_driver import SceneError
from transientcam_simulation.scene import (
    Mesh,
    Scene,
    _mesh_file as mesh_file,
    load_scene,
    parse_scene,
)

LIGHT = "light = { electrons_per_s = 4e6, position_m = [0, 0, 0.1], aim_at_m = [0, 1, 0] }\n"
SURFACE = '[[surface]]\nkind = "diffuse"\nshape = "mesh"\n'


def scene(folder: Path, name: str, more: str = "albedo = 0.5") -> Scene:
    path = folder / "scene.toml"
    path.write_text(f'{LIGHT}{SURFACE}file = "{name}"\n{more}')
    return load_scene(path)


def mesh_of(scene: Scene) -> Mesh:
    shape = scene.surfaces[0].shape
    assert isinstance(shape, Mesh)
    return shape


def bar() -> trimesh.Trimesh:
    """Longest along x, shortest along z."""
    made: trimesh.Trimesh = trimesh.creation.box((3.0, 2.0, 1.0))
    return made


def linear(colour: int) -> float:
    """Of sRGB, IEC 61966-2-1."""
    return float(((colour / 255 + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize(
    ("suffix", "size_m"),
    [("obj", (3, 2, 1)), ("ply", (3, 2, 1)), ("stl", (3, 2, 1)), ("glb", (3, 1, 2))],
)
def test_a_file_of_each_format_holds_the_same_triangles_and_y_is_up_in_gltf(
    tmp_path: Path, suffix: str, size_m: tuple[float, ...]
) -> None:
    bar().export(tmp_path / f"bar.{suffix}")

    mesh = mesh_of(scene(tmp_path, f"bar.{suffix}"))

    assert len(mesh.corners) == 12
    low, high = mesh.box
    assert high - low == pytest.approx(size_m)
    assert mesh.normals is not None
    assert scene(tmp_path, f"bar.{suffix}").surfaces[0].reflectivity == 0.5
    assert mesh_of(scene(tmp_path, f"bar.{suffix}", "albedo = 1\nsmooth = false")).normals is None


def test_a_mesh_is_scaled_turned_about_x_then_y_then_z_and_moved(tmp_path: Path) -> None:
    bar().export(tmp_path / "bar.ply")
    placed = "scale = 0.1\nrotation_deg = [90, 0, 90]\nposition_m = [1, 2, 3]\nalbedo = 1"

    low, high = mesh_of(scene(tmp_path, "bar.ply", placed)).box

    # about x: 3, 1, 2; then about z: 1, 3, 2
    assert high - low == pytest.approx([0.1, 0.3, 0.2])
    assert (high + low) / 2 == pytest.approx([1, 2, 3])
    quarter = mesh_of(scene(tmp_path, "bar.ply", "rotation_deg = [0, 0, 90]\nalbedo = 1"))
    assert quarter.corners[..., 1] == pytest.approx(np.asarray(bar().triangles)[..., 0])


def test_instances_of_a_gltf_file_are_placed_and_their_normals_stay_across(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    both = trimesh.Scene()
    flat = np.diag([1.0, 0.25, 1.0, 1.0])
    both.add_geometry(ball, geom_name="ball", transform=flat)
    aside = trimesh.transformations.translation_matrix([5.0, 0.0, 0.0])
    both.add_geometry(ball, geom_name="ball", transform=aside @ flat)
    both.export(tmp_path / "two.glb")

    mesh = mesh_of(scene(tmp_path, "two.glb"))

    assert len(mesh.corners) == 2 * len(ball.faces)
    low, high = mesh.box
    assert high - low == pytest.approx([7.0, 2.0, 0.5], abs=0.01)
    gradient = mesh.corners * [1, 1, 16]
    gradient[mesh.corners[..., 0] > 2] -= [5, 0, 0]
    assert mesh.normals is not None
    normals = mesh.normals / np.linalg.norm(mesh.normals, axis=2, keepdims=True)
    expected = gradient / np.linalg.norm(gradient, axis=2, keepdims=True)
    assert (normals * expected).sum(axis=2).min() > 0.99


def textured(folder: Path, name: str) -> None:
    """A square whose left half is black, and whose right half is grey above, white below."""
    image = Image.fromarray(np.array([[0, 128], [0, 255]], dtype=np.uint8)).convert("RGB")
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], dtype=float)
    if name.endswith("glb"):
        corners = corners[:, [0, 2, 1]]
    square = trimesh.Trimesh(corners, [[0, 1, 2], [2, 3, 0]], process=False)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    material: Any = trimesh.visual.material
    made = (
        material.PBRMaterial(baseColorTexture=image)
        if name.endswith("glb")
        else material.SimpleMaterial(image=image)
    )
    square.visual = trimesh.visual.TextureVisuals(uv=uv, material=made)
    square.export(folder / name)


@pytest.mark.parametrize("name", ["square.glb", "square.obj"])
def test_the_luminance_of_a_texture_is_the_albedo(tmp_path: Path, name: str) -> None:
    textured(tmp_path, name)

    loaded = scene(tmp_path, name, "")
    mesh = mesh_of(loaded)
    middles = mesh.box[0] + np.subtract(*mesh.box[::-1]) * np.array(
        [[0.25, 0.25, 0.25], [0.75, 0.75, 0.75], [0.75, 0.25, 0.25]]
    )
    normal = np.subtract(*mesh.box[::-1]).argmin()
    ways = np.eye(3)[np.full(3, normal)]
    fraction, triangle = mesh.first_met(middles - ways, middles + ways)
    _, share = mesh.seen(middles - ways + 2 * fraction[:, None] * ways, ways, triangle)

    assert loaded.surfaces[0].reflectivity == 1
    assert share == pytest.approx([0, linear(128), 1], abs=0.01)


def test_colours_of_vertices_and_of_triangles_are_albedo(tmp_path: Path) -> None:
    by_vertex, by_face = bar(), bar()
    visual: Any = by_vertex.visual
    visual.vertex_colors = [[188, 188, 188, 255]] * len(by_vertex.vertices)
    visual = by_face.visual
    visual.face_colors = [[255, 0, 0, 255]] * 6 + [[0, 255, 0, 255]] * 6
    by_vertex.export(tmp_path / "vertex.ply")
    by_face.export(tmp_path / "face.ply")

    grey, halves = (mesh_of(scene(tmp_path, each, "")) for each in ("vertex.ply", "face.ply"))

    assert grey.share == pytest.approx(np.full((12, 3), linear(188)), rel=1e-5)
    assert halves.share == pytest.approx(np.repeat([0.2126, 0.7152], 6)[:, None] * np.ones(3))


def glb(folder: Path, change: Callable[[dict[str, Any]], None]) -> str:
    """Write a glTF file with another header than it should have."""
    exported: Any = bar().export(file_type="glb")
    data = bytes(exported)
    (length,) = struct.unpack("<I", data[12:16])
    header = json.loads(data[20 : 20 + length])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    (folder / "made.glb").write_bytes(head + text + rest)
    return "made.glb"


def without_data(header: dict[str, Any]) -> None:
    del header["accessors"][1]["bufferView"]
    header["accessors"][1]["count"] = 10**11


def elsewhere(header: dict[str, Any]) -> None:
    header["buffers"] = [{"uri": "../secret.bin", "byteLength": 100}]
    header["images"] = [{"uri": "https://example.org/a.png"}]


BROKEN: list[tuple[str, str | bytes, str, str]] = [
    ("a.ply", "ply\nformat ascii 1.0\nelement vertex 100000000000\n", "the file", "can be read"),
    ("a.ply", b"\0" * 100, "the file", "can be read"),
    ("a.glb", b"glTF\2\0\0\0\xff\xff\xff\xff\xff\xff\xff\x7fJSON{", "the file", "can be read"),
    ("a.gltf", '{"accessors": 3}', "the file", "can be read"),
    (
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
        "its numbers|the file",
        "indices|can be read",
    ),
    ("a.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "its numbers", "finite"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "the area of its triangles", "above 0"),
    ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\n", "the file|triangles", "can be read|from 1"),
    ("a.obj", "mtllib ../a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a file named", "folder"),
    ("a.obj", "mtllib http://b.c/d\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a file", "folder"),
    ("a.obj", "", "a file named there", "of 1 to"),
    ("a.exe", "", "the file", ".glb, .gltf, .obj, .ply, .stl"),
]


@pytest.mark.parametrize(("name", "content", "key", "allowed"), BROKEN)
def test_a_file_that_is_broken_or_names_others_is_refused(
    tmp_path: Path, name: str, content: str | bytes, key: str, allowed: str
) -> None:
    (tmp_path / "a.mtl").write_text("newmtl x\nKd 1 1 1\n")
    folder = tmp_path / "inner"
    folder.mkdir()
    data = content.encode() if isinstance(content, str) else content
    (folder / name).write_bytes(data)

    with pytest.raises(SceneError) as caught:
        scene(folder, name)

    assert caught.value.file == str(folder / name)
    assert any(each in caught.value.key for each in key.split("|"))
    assert any(each in caught.value.allowed for each in allowed.split("|"))
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("change", "key"),
    [(without_data, "the count of an accessor"), (elsewhere, "a file named there")],
)
def test_a_gltf_header_that_asks_for_too_much_or_for_other_places_is_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], key: str
) -> None:
    (tmp_path / "secret.bin").write_bytes(b"secret" * 100)
    folder = tmp_path / "inner"
    folder.mkdir()

    with pytest.raises(SceneError) as caught:
        scene(folder, glb(folder, change))

    assert caught.value.key == key


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    bar().export(tmp_path / "bar.ply")
    folder = tmp_path / "inner"
    folder.mkdir()
    (folder / "x.obj").write_text("mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "x.mtl").write_text("newmtl x\nKd 1 1 1\n")
    (folder / "x.mtl").symlink_to(tmp_path / "x.mtl")

    with pytest.raises(SceneError, match="a file in its folder"):
        scene(folder, "x.obj")


@pytest.mark.parametrize(
    ("limit", "most", "key", "value"),
    [
        ("MOST_TRIANGLES", 11, "triangles", 12),
        ("MOST_TEXELS", 3, "texels of a texture", 4),
        ("MOST_BYTES", 20, "a file named there", None),
    ],
)
def test_a_file_of_more_than_may_be_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str, most: int, key: str, value: object
) -> None:
    bar().export(tmp_path / "bar.ply")
    textured(tmp_path, "square.glb")
    monkeypatch.setattr(mesh_file, limit, most)

    with pytest.raises(SceneError) as caught:
        scene(tmp_path, "square.glb" if limit == "MOST_TEXELS" else "bar.ply")

    assert caught.value.key == key
    assert value is None or caught.value.value == value
    assert str(most) in caught.value.allowed


@pytest.mark.parametrize(
    ("more", "key", "allowed"),
    [
        ("", "surface[0].albedo", "present"),
        ("albedo = 1\nscale = 1e8", "surface[0].scale", "is more than 1e+06"),
        ("albedo = 1\nscale = 0", "surface[0].scale", "at least 1e-09"),
        ("albedo = 1\nmotion = 'a'", "surface[0].motion", "a mesh stays in its place"),
        ("albedo = 1\ncentre_m = [0, 0, 0]", "surface[0].centre_m", "position_m"),
        ("albedo = 1\nrotation_deg = [0, 0]", "surface[0].rotation_deg", "3 numbers"),
    ],
)
def test_an_error_of_the_scene_names_its_key(
    tmp_path: Path, more: str, key: str, allowed: str
) -> None:
    bar().export(tmp_path / "bar.ply")

    with pytest.raises(SceneError) as caught:
        scene(tmp_path, "bar.ply", more)

    assert caught.value.key == key
    assert allowed in caught.value.allowed


def test_a_scene_that_is_sent_names_no_mesh_of_this_disk(tmp_path: Path) -> None:
    bar().export(tmp_path / "bar.ply")

    with pytest.raises(SceneError) as caught:
        parse_scene(f'{LIGHT}{SURFACE}file = "{tmp_path / "bar.ply"}"\nalbedo = 1')

    assert caught.value.key == "surface[0].file"
    assert "cannot name files" in caught.value.allowed


def test_without_the_extra_an_error_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bar().export(tmp_path / "bar.ply")
    monkeypatch.setitem(sys.modules, "embreex", None)

    with pytest.raises(SceneError, match=r"pip install 'transientcam\[mesh\]'"):
        scene(tmp_path, "bar.ply")


def test_a_file_that_was_changed_is_read_anew(tmp_path: Path) -> None:
    bar().export(tmp_path / "bar.ply")
    before = mesh_of(scene(tmp_path, "bar.ply"))
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "bar.ply")

    after = mesh_of(scene(tmp_path, "bar.ply"))

    assert (len(before.corners), len(after.corners)) == (12, 80)
