"""Surfaces cut into patches, and the share of its light that each patch gives to each other one."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import ask
from transientcam_simulation.light._paths import at_panes, blocked
from transientcam_simulation.scene import Cells, Points, Scene, cells_of, evenly, patch_edges_m

Cuts = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Where a surface is cut over its height, and over its width or longitude."""
_BLOCK = 1 << 18  # segments at a time
_PLACES = 4  # a side, of a patch that is seen in part
_OFF_M = 1e-9


@dataclass(frozen=True, slots=True)
class Patches:
    """All patches of the scattering surfaces of a scene, flat.

    ``surface``: (N) index of the surface a patch is cut from.
    ``cells``: by the surface's index, its grid; ``first`` is where its patches begin.
    """

    surface: NDArray[np.intp]
    centre: Points
    normal: Points
    corners: Points
    albedo: NDArray[np.float64]
    cells: dict[int, Cells]
    first: dict[int, int]

    def __len__(self) -> int:
        """Patches in all."""
        return len(self.centre)

    @classmethod
    def of(cls, scene: Scene, per_side: int, *, moving: int = 0) -> "Patches":
        """Cut the longest side of all surfaces into so many patches: see `patch_edges_m`."""
        edges_m = patch_edges_m(scene, per_side, moving=moving).items()
        counts = {k: scene.surfaces[k].primitive.grid(edge_m) for k, edge_m in edges_m}
        return cls.cut(scene, {k: (evenly(up), evenly(along)) for k, (up, along) in counts.items()})

    @classmethod
    def cut(cls, scene: Scene, cuts: dict[int, Cuts]) -> "Patches":
        """Cut the scattering surfaces, by their index, at places from -1 to 1."""
        cells = {
            index: cells_of(scene.surfaces[index].primitive, *at) for index, at in cuts.items()
        }
        grids, counts = list(cells.values()), [len(grid.centre) for grid in cells.values()]
        return cls(
            np.repeat(list(cells), counts),
            np.concatenate([grid.centre for grid in grids]),
            np.concatenate([grid.normal for grid in grids]),
            np.concatenate([grid.corners for grid in grids]),
            np.repeat([scene.surfaces[index].reflectivity for index in cells], counts),
            cells,
            dict(zip(cells, np.cumsum([0, *counts]).tolist(), strict=False)),
        )

    def places(self, count: int) -> Points:
        """Return evenly spread places (N, count^2, 3) on them."""
        middles, c = (2 * np.arange(count) + 1) / (2 * count), self.corners
        u, w = (grid.ravel() for grid in np.meshgrid(middles, middles))
        places: Points = (
            np.einsum("s,nc->nsc", (1 - u) * (1 - w), c[:, 0])
            + np.einsum("s,nc->nsc", u * (1 - w), c[:, 1])
            + np.einsum("s,nc->nsc", u * w, c[:, 2])
            + np.einsum("s,nc->nsc", (1 - u) * w, c[:, 3])
        )
        return places

    def at(self, scene: Scene, point: Points, surface: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the patches whose middles are nearest to points on surfaces."""
        found = np.zeros(len(point), dtype=np.intp)
        for index, cells in self.cells.items():
            mine = surface == index
            if mine.any():
                near, weight = scene.surfaces[index].primitive.between_cells(point[mine], cells)
                nearest = np.take_along_axis(near, weight.argmax(axis=1)[:, None], axis=1)
                found[mine] = self.first[index] + nearest[:, 0]
        return found

    def moved(self, by_m: Points) -> "Patches":
        """Return them where surfaces (S, 3) are moved."""
        by_m = by_m[self.surface]
        corners = self.corners + by_m[:, None]
        return replace(self, centre=self.centre + by_m, corners=corners)

    def part(self, of: NDArray[np.intp]) -> "Patches":
        """Return some of them, by index; grids stay those of all."""
        lines = ("surface", "centre", "normal", "corners", "albedo")
        return replace(self, **{name: getattr(self, name)[of] for name in lines})


def form_factors(
    scene: Scene, patches: Patches, at: Points, normal: Points, *, shares: bool = False
) -> NDArray[np.float64]:
    """Irradiance (P, N) at points by each patch of radiosity 1: Lambert's contour integral.

    Patches that face away, stand behind the point's surface, or are hidden, give nothing. A patch
    that the point's horizon cuts counts by its centre. ``shares``: one that is hidden and beside
    one that is not, or the other way, counts by the share of its places that are seen.
    """
    factors = np.zeros((len(at), len(patches)))
    rows = max(1, _BLOCK // max(1, len(patches)))
    hides = len(scene.surfaces) > 0
    for first in range(0, len(at), rows):
        ask()
        block = slice(first, first + rows)
        way = patches.centre[None, :, :] - at[block, None, :]
        towards = np.einsum("pnc,pc->pn", way, normal[block]) > 1e-9
        back = np.einsum("pnc,nc->pn", way, patches.normal) < -1e-9
        p, n = np.nonzero(towards & back)
        seen = np.full(way.shape[:2], np.nan)
        seen[p, n] = 1.0
        if hides:
            seen[p, n] = ~_blocked(scene, patches, at[block][p], n)
            if shares:
                _share(scene, patches, at[block], seen)
            p, n = np.nonzero(seen > 0)
        corners = patches.corners[n] - at[block][p][:, None, :]
        factors[block][p, n] = contour(corners, normal[block][p]) * seen[p, n]
        if scene.panes:
            factors[block][p, n] *= at_panes(scene, (), (patches.centre[n],), at[block][p])[0]
    return factors


def _share(scene: Scene, patches: Patches, at: Points, seen: NDArray[np.float64]) -> None:
    """Put in shares (P, N) of what is seen at the edges between 0 and 1; NaN is of no account."""
    edge = np.zeros(seen.shape, dtype=bool)
    for k, cells in patches.cells.items():
        mine = slice(patches.first[k], patches.first[k] + len(cells.centre))
        of = seen[:, mine].reshape(-1, cells.rows, cells.columns)
        at_edge = np.zeros(of.shape, dtype=bool)
        for axis in (1, 2):
            values, marked = np.moveaxis(of, axis, 0), np.moveaxis(at_edge, axis, 0)
            differ = np.abs(values[1:] - values[:-1]) > 0
            marked[1:] |= differ
            marked[:-1] |= differ
        edge[:, mine] = at_edge.reshape(len(seen), -1)
    p, n = np.nonzero(edge)
    total = np.zeros(len(p))
    for point in patches.places(_PLACES).swapaxes(0, 1):
        total += ~blocked(scene, at[p], point[n] + _OFF_M * patches.normal[n])
    seen[p, n] = total / _PLACES**2


def _blocked(
    scene: Scene, patches: Patches, at: Points, patch: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Whether anything hides a patch's centre from a point."""
    if len(patches.cells) == 2 and len(scene.surfaces) == 2 and _convex(scene):
        return np.zeros(len(at), dtype=bool)
    return blocked(scene, at, patches.centre[patch])


def _convex(scene: Scene) -> bool:
    """Whether both of two surfaces are flat, so that neither hides parts of itself or the other."""
    return all(hasattr(surface.shape, "right") for surface in scene.surfaces)


def contour(corners: Points, normal: Points) -> NDArray[np.float64]:
    """Form factor of polygons (P, 4, 3), relative to points with normals (P, 3)."""
    unit = np.ascontiguousarray(corners.transpose(1, 2, 0))  # long rows, along the polygons
    unit /= np.sqrt(np.einsum("kcp,kcp->kp", unit, unit))[:, None]
    following = np.roll(unit, -1, axis=0)
    cross = np.roll(unit, -1, axis=1) * np.roll(following, 1, axis=1)
    cross -= np.roll(unit, 1, axis=1) * np.roll(following, -1, axis=1)
    sine = np.sqrt(np.einsum("kcp,kcp->kp", cross, cross))
    cosine = np.einsum("kcp,kcp->kp", unit, following)
    angle = np.arctan2(sine, cosine)
    with np.errstate(divide="ignore", invalid="ignore"):
        edge = np.where(sine > 0, angle / sine, 0.0)
    # counter-clockwise from the patch's front is clockwise around the normal at the point
    above = np.einsum("kcp,cp->kp", cross, np.ascontiguousarray(normal.T))
    total = -np.einsum("kp,kp->p", edge, above) / (2 * np.pi)
    clipped: NDArray[np.float64] = np.clip(total, 0.0, 1.0)
    return clipped
