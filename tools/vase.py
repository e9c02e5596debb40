"""Draws the mesh of docs/scenes.md: ``python -m tools.vase``; its scene is left in build/vase."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import trimesh
from PIL import Image

from transientcam_driver import Sequence
from transientcam_simulation.emulated import find_scene, world_of

_ROOT = Path(__file__).parents[1]
_SCENE = """\
light = { electrons_per_s = 4e6, position_m = [0.3, 0, 0.3], aim_at_m = [0, 2, 0] }
surface = [
    { kind = "diffuse", shape = "mesh", file = "vase.glb", position_m = [0, 1.6, -0.4] },
    { kind = "diffuse", centre_m = [0, 2.4, 0], normal = [0, -1, 0], size_m = [3, 3], albedo = 0.7 },
]
"""  # noqa: E501 - as docs/scenes.md has it


def vase() -> trimesh.Trimesh:
    """Return a surface of revolution with ribs, y up, and waves on its texture."""
    rows, columns = 160, 320
    height = np.linspace(0, 1, rows)[:, None]
    turn = np.linspace(0, 2 * np.pi, columns)
    radius = 0.16 + 0.13 * np.sin(1.25 * np.pi * height + 0.15) ** 2
    radius = radius * (1 + 0.05 * np.cos(12 * turn + 4 * height))
    y = np.broadcast_to(0.8 * height, radius.shape)
    corners = np.stack([radius * np.sin(turn), y, radius * np.cos(turn)], axis=-1)
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    halves = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (c, d, a))]
    uv = np.stack(np.broadcast_arrays(turn / (2 * np.pi), height), axis=-1)
    row, column = np.mgrid[:512, :1024]
    texture = np.full((512, 1024, 3), 225, np.uint8)
    texture[(row + 22 * np.sin(column / 1024 * 16 * np.pi)) % 128 < 46] = 70, 90, 160
    made = trimesh.Trimesh(corners.reshape(-1, 3), np.concatenate(halves), process=False)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(texture))
    made.visual = trimesh.visual.TextureVisuals(uv=uv.reshape(-1, 2), material=material)
    return made


def main() -> None:
    """Write the scene and its picture."""
    folder = _ROOT / "build" / "vase"
    folder.mkdir(parents=True, exist_ok=True)
    vase().export(folder / "vase.glb")
    (folder / "vase.toml").write_text(_SCENE, encoding="utf-8")
    scene = find_scene(str(folder / "vase.toml"))
    world = world_of(scene, width=163, height=120, readout_s=4e-3)
    sequence = Sequence()
    world.configure(sequence, sequence.labels)
    label = sequence.labels[0]
    image_e = np.asarray(world.mean_image_e(label, number=0, device_time_s=5.0), float)
    range_m = world.truth(device_time_s=5.0).range_m
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.2, 3.2), constrained_layout=True)
    left.imshow(image_e, cmap="gray")
    left.set_title("one image, electrons")
    figure.colorbar(right.imshow(range_m, cmap="viridis"), ax=right)
    right.set_title("true range, m")
    for each in (left, right):
        each.set(xticks=[], yticks=[])
    figure.savefig(_ROOT / "docs" / "figures" / "mesh.png", dpi=100)


if __name__ == "__main__":
    main()
