"""What a scene will need before its light is known, and how much of it one from elsewhere may.

It is counted as the light is built, by the same functions (`patch_edges_m`, `Rectangle.grid`).
"""

import math
from typing import Final

import numpy as np

from transientcam_driver.errors import SceneError
from transientcam_simulation.scene._mesh import Mesh
from transientcam_simulation.scene._scene import Scene

MOST_SURFACES: Final = 32
MOST_MIRROR_PATHS: Final = 64
"""Chains of mirrors that light may take, each of which is followed."""
MOST_PATCHES: Final = 4096
"""Between scattering surfaces: their matrices take 128 MiB, and 0.5 GiB while they are made.

Fewer where mirrors show them to each other.
"""
_LEAST_PER_SIDE: Final = 4
"""Patches along the longest side of a surface, however small it is beside others."""


def patch_edges_m(scene: Scene, per_side: int, *, moving: int = 0) -> dict[int, float]:
    """Return how long the edges of the patches of each scattering surface are, by its index.

    The longest side of all surfaces is cut into ``per_side`` patches, the others as finely; what
    moves as if there were ``moving`` of them, if these are more. Meshes are not cut.
    """
    sides_m = {
        index: float(np.ptp(each.shape.extent(), axis=0).max())
        for index, each in enumerate(scene.surfaces)
        if each.scatters and not isinstance(each.shape, Mesh)
    }
    longest_m = max(sides_m.values(), default=0.0)
    counts = {k: max(per_side, moving if scene.surfaces[k].speed_m_s else 0) for k in sides_m}
    return {k: min(longest_m / counts[k], m / _LEAST_PER_SIDE) for k, m in sides_m.items()}


def patches_of(scene: Scene, per_side: int) -> int:
    """Return how many patches the scattering surfaces of a scene are cut into."""
    grids = (
        scene.surfaces[index].primitive.grid(edge_m)
        for index, edge_m in patch_edges_m(scene, per_side).items()
    )
    return sum(rows * columns for rows, columns in grids)


def mirror_paths_of(scene: Scene) -> int:
    """Return how many chains of mirrors and sides of panes there are: none from one to itself."""
    mirrors = len(scene.mirrors)
    bounces = range(1, scene.mirror_bounces + 1)
    return sum(mirrors * (mirrors - 1) ** (each - 1) for each in bounces)


def most_patches(scene: Scene) -> int:
    """Return into how many patches surfaces may be cut: they see each other over mirrors, too.

    But for scenes that move.
    """
    return int(MOST_PATCHES / math.sqrt(1 + (0 if scene.moves else mirror_paths_of(scene))))


def require_modest(scene: Scene) -> None:
    """Refuse a scene that would take much memory or time to prepare.

    Raises SceneError naming the key, its value and the limit.
    """
    surfaces, transport = scene.surfaces, scene.transport
    if len(surfaces) > MOST_SURFACES:
        raise SceneError("the scene", "surface", len(surfaces), f"at most {MOST_SURFACES} tables")
    paths = mirror_paths_of(scene)
    if paths > MOST_MIRROR_PATHS:
        limit = f"fewer: {paths} chains of mirrors are more than {MOST_MIRROR_PATHS}"
        raise SceneError("the scene", "transport.mirror_bounces", transport.mirror_bounces, limit)
    limit_of, patches = most_patches(scene), patches_of(scene, transport.patches)
    if transport.diffuse_bounces != 0 and patches > limit_of:
        fewer = (n for n in range(2, transport.patches) if patches_of(scene, n) <= limit_of)
        most = max(fewer, default=0)
        limit = (
            f"{f'at most {most} with these surfaces, or ' if most else ''}diffuse_bounces = 0: "
            f"{patches} patches are more than {limit_of}"
        )
        raise SceneError("the scene", "transport.patches", transport.patches, limit)
