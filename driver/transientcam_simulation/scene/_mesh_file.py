"""Read meshes from glTF, OBJ, PLY and STL files, which are others' and may hold anything.

Nothing beyond the folder of a file is read for it, and nothing from a network.
"""

import io
import json
import struct
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError
from transientcam_simulation.scene._mesh import Mesh, Texture

MOST_BYTES: Final = 1 << 28
"""Of a file, and of each that it refers to."""
MOST_TRIANGLES: Final = 1_000_000
MOST_TEXELS: Final = 1 << 26
_TYPES: Final = (".glb", ".gltf", ".obj", ".ply", ".stl")
_UPRIGHT: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""In glTF y points up, and the front of things to +z: towards a camera that looks along +y."""
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])  # of linear RGB, Rec. ITU-R BT.709
_SHOWN: Final = 200  # characters of what a reader says


def load_mesh(path: Path, *, smooth: bool) -> tuple[Mesh, bool]:
    """Return what a file holds, z pointing up, in its own unit, and whether all of it has a colour.

    Reflectance is the luminance of colours and textures. ``smooth``: with normals at the vertices,
    those of the file if it has any. Raises SceneError naming the file, what it has, and the limit.
    """
    try:
        stated = path.stat()
    except OSError as error:
        raise SceneError(path, "the file", error.strerror, "readable") from error
    return _loaded(path, smooth, stated.st_mtime_ns, stated.st_size)


@lru_cache(maxsize=4)
def _loaded(path: Path, smooth: bool, *_as_it_was: int) -> tuple[Mesh, bool]:
    suffix = path.suffix.lower()
    if suffix not in _TYPES:
        raise SceneError(path, "the file", path.name, f"one of {', '.join(_TYPES)}")
    try:
        import embreex  # noqa: F401
        import PIL.Image  # noqa: F401
        import trimesh
    except ImportError as error:
        needs = "readable: meshes need `pip install 'transientcam[mesh]'`"
        raise SceneError(path, "the file", str(error), needs) from error
    beside = _Beside(path)
    resolver: Any = beside
    try:
        data = beside.get(path.name)
        if suffix in (".glb", ".gltf"):
            _require_counts(path, data)
        scene = trimesh.load_scene(io.BytesIO(data), suffix[1:], resolver, process=False)
        if beside.refused is not None:  # the reader itself goes on without
            raise beside.refused
        return _joined(path, scene, smooth=smooth, is_gltf=suffix in (".glb", ".gltf"))
    except SceneError:
        raise
    except Exception as error:  # whatever broken files make of their reader
        said = f"{type(error).__name__}: {error}"[:_SHOWN]
        raise SceneError(path, "the file", said, "a mesh that can be read") from error


class _Beside:
    """Files in the folder of one, and below it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.refused: SceneError | None = None

    def get(self, name: str) -> bytes:
        """Read a file by its name. Raises SceneError where it is elsewhere, too large or absent."""
        try:
            folder = self._path.parent.resolve()
            found = (folder / name.strip()).resolve()
            if found.is_relative_to(folder) and 0 < found.stat().st_size <= MOST_BYTES:
                return found.read_bytes()
        except (OSError, ValueError):
            pass  # absent, or no name of a file
        limit = f"a file in its folder, of 1 to {MOST_BYTES} bytes"
        self.refused = SceneError(self._path, "a file named there", name[:_SHOWN], limit)
        raise self.refused

    __getitem__ = get


def _require_counts(path: Path, data: bytes) -> None:
    """Refuse numbers without end: what is declared without data is made as zeros."""
    if data[:4] == b"glTF":
        data = data[20 : 20 + struct.unpack("<I", data[12:16])[0]]
    for each in json.loads(data).get("accessors", ()):
        if not 0 <= each["count"] <= 3 * MOST_TRIANGLES:
            limit = f"from 0 to {3 * MOST_TRIANGLES}"
            raise SceneError(path, "the count of an accessor", each["count"], limit)


def _joined(path: Path, scene: Any, *, smooth: bool, is_gltf: bool) -> tuple[Mesh, bool]:
    """Put the triangles of all instances in one mesh."""
    placed = [
        (turn, scene.geometry[k]) for turn, k in map(scene.graph.get, scene.graph.nodes_geometry)
    ]
    placed = [(turn, each) for turn, each in placed if hasattr(each, "faces")]
    count = sum(len(each.faces) for _, each in placed)
    if not 0 < count <= MOST_TRIANGLES:
        raise SceneError(path, "triangles", count, f"from 1 to {MOST_TRIANGLES}")
    parts: list[tuple[NDArray[Any], ...]] = []
    images: list[Any] = []
    coloured = True
    for transform, each in placed:
        share, image = _colour(each, linear=is_gltf)
        coloured &= share is not None
        texture = next((k for k, other in enumerate(images) if other is image), len(images))
        if image is not None and texture == len(images):
            images.append(image)
        faces, turn = np.asarray(each.faces), transform[:3, :3]
        cofactors = np.stack([np.cross(turn[k - 2], turn[k - 1]) for k in range(3)])
        parts.append((
            (np.asarray(each.vertices, float) @ turn.T + transform[:3, 3])[faces],
            (np.asarray(each.vertex_normals) @ cofactors.T)[faces] if smooth else faces[..., None],
            np.broadcast_to(1.0 if share is None else share, faces.shape),
            np.zeros((*faces.shape, 2)) if image is None else np.asarray(each.visual.uv)[faces],
            np.full(len(faces), -1 if image is None else texture),
        ))  # fmt: skip
    corners, normals, share, uv, textures = map(np.concatenate, zip(*parts, strict=True))
    if is_gltf:
        corners, normals = corners @ _UPRIGHT.T, normals @ _UPRIGHT.T if smooth else normals
    sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(*sides), axis=-1) / 2
    if not (np.isfinite(area).all() and np.isfinite(normals).all() and np.isfinite(uv).all()):
        raise SceneError(path, "its numbers", "some", "finite")
    if not area.any():
        raise SceneError(path, "the area of its triangles", 0.0, "above 0")
    kept = area > 0
    mesh = Mesh(
        corners[kept],
        normals[kept].astype(np.float32) if smooth else None,
        share[kept].astype(np.float32),
        uv[kept].astype(np.float32),
        textures[kept].astype(np.int32),
        tuple(_texture(path, image) for image in images),
    )
    return mesh, coloured


def _colour(part: Any, *, linear: bool) -> tuple[NDArray[np.float64] | None, Any]:
    """Return reflectance (T, 3) by triangle and corner, None without a colour, and an image."""
    visual = part.visual
    if visual.kind in ("vertex", "face"):
        colours = np.asarray(getattr(visual, f"{visual.kind}_colors"))
        share = _luminance(colours, linear=linear)
        return share[part.faces] if visual.kind == "vertex" else share[:, None], None
    if visual.kind != "texture":
        return None, None
    material = visual.material
    image = getattr(material, "baseColorTexture" if linear else "image", None)
    if image is not None or linear:  # of OBJ an image counts alone, as many have black beside it
        colour = getattr(material, "baseColorFactor", None)
    else:
        colour = material.main_color
    if colour is None:
        return None if image is None else np.ones((1, 1)), image
    return _luminance(np.asarray(colour)[None, None], linear=linear), image


def _luminance(colours: NDArray[Any], *, linear: bool) -> NDArray[np.float64]:
    """Return that of colours (..., 3 or more) of 8 bits: linear ones, or sRGB's."""
    values = np.arange(256) / 255
    if not linear:
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    luminance = np.zeros(colours.shape[:-1])
    for k, part in enumerate(_LUMINANCE):
        luminance += (part * values)[colours[..., k]]
    return luminance


def _texture(path: Path, image: Any) -> Texture:
    texels = image.width * image.height
    if not 0 < texels <= MOST_TEXELS:
        raise SceneError(path, "texels of a texture", texels, f"from 1 to {MOST_TEXELS}")
    return Texture(_luminance(np.asarray(image.convert("RGB")), linear=False).astype(np.float32))
