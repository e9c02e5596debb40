"""A shape of triangles: hits by Embree, normals and albedo within a triangle."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.scene._geometry import Points, Values

_CLEAR = 2e-5
"""Of the diagonal of its box: what is so near to an end of a segment does not count as met.

Embree's single precision is of a thousandth of this."""


@dataclass(frozen=True, slots=True)
class Texture:
    """Reflectance over a square, (H, W) from the top; it repeats."""

    texels: NDArray[np.float32]

    def at(self, u: Values, v: Values) -> Values:
        """Interpolate linearly between texels; u points right, v up, and 1 is the square's side."""
        height, width = self.texels.shape
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
        right, down = x - column, y - row
        rows, columns = (row % height, (row + 1) % height), (column % width, (column + 1) % width)
        upper, lower = (
            (1 - right) * self.texels[each, columns[0]] + right * self.texels[each, columns[1]]
            for each in rows
        )
        between: Values = (1 - down) * upper + down * lower
        return between


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that scatter on both sides; parts thinner than a pixel show where a ray meets them.

    ``corners``: (T, 3, 3) of triangles, in m.
    ``normals``: (T, 3, 3) at the corners, of any length; None: flat triangles.
    ``share``: (T, 3) of light that is reflected at the corners, times that of a texture.
    ``uv``: (T, 3, 2) places in a texture.
    ``texture``: (T) index into ``textures``; -1: none.
    """

    corners: Points
    normals: NDArray[np.float32] | None
    share: NDArray[np.float32]
    uv: NDArray[np.float32]
    texture: NDArray[np.int32]
    textures: tuple[Texture, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what Embree made of it, which is made anew."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def placed(self, turn: NDArray[np.float64], position_m: Points) -> "Mesh":
        """Return it turned by a matrix (3, 3), a rotation of any scale, and then moved."""
        normals = None if self.normals is None else (self.normals @ turn.T).astype(np.float32)
        return replace(self, corners=self.corners @ turn.T + position_m, normals=normals)

    @cached_property
    def box(self) -> tuple[Points, Points]:
        """Lowest and highest coordinates."""
        return self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))

    def extent(self) -> Points:
        """Return points (N, 3) whose convex hull holds it: the corners of its box."""
        return np.stack(np.meshgrid(*np.transpose(self.box)), axis=-1).reshape(-1, 3)

    def hit(self, start: Points, end: Points) -> Values:
        """Fraction of the way at which segments hit a triangle; infinity where they miss."""
        return self.first_met(start, end)[0]

    def first_met(self, start: Points, end: Points) -> tuple[Values, NDArray[np.intp]]:
        """Return that fraction, and the triangle by index, -1 for none."""
        scene, middle = self._in_embree
        way = end - start
        length_m = np.maximum(np.linalg.norm(way, axis=-1), 1e-12)
        clear = np.minimum(self._clear_m / length_m, 0.5)
        found = scene.run(
            (start + clear[:, None] * way - middle).astype(np.float32),
            way.astype(np.float32),
            dists=(1 - 2 * clear).astype(np.float32),
            query="INTERSECT",
            output=True,
        )
        triangle = found["primID"].astype(np.intp)
        met = np.flatnonzero(triangle >= 0)
        # where its plane is in double precision, so that what starts there starts on it
        corner, normal = self.corners[triangle[met], 0], self._facets[triangle[met]]
        fraction = np.full(len(way), np.inf)
        along = np.einsum("pc,pc->p", way[met], normal)
        off = np.einsum("pc,pc->p", corner - start[met], normal)
        single = clear[met] + found["tfar"][met]
        with np.errstate(divide="ignore", invalid="ignore"):
            exact = off / along
        beside = np.abs(exact - single) * length_m[met] < self._clear_m
        fraction[met] = np.where(beside, exact, single)
        return fraction, triangle

    def seen(
        self, point: Points, direction: Points, triangle: NDArray[np.intp]
    ) -> tuple[Points, Values]:
        """Return unit normals towards where rays come from, and reflectance, at points on it."""
        corners, facet = self.corners[triangle], self._facets[triangle]
        edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        off = point - corners[:, 0]
        double = np.einsum("pc,pc->p", np.cross(*edges), facet)
        second = np.einsum("pc,pc->p", np.cross(off, edges[1]), facet) / double
        third = np.einsum("pc,pc->p", np.cross(edges[0], off), facet) / double
        weights = np.stack([1 - second - third, second, third], axis=-1).clip(0, 1)

        def mixed(values: NDArray[np.float32]) -> Points:
            found: Points = np.einsum("pk,pk...->p...", weights, values[triangle])
            return found

        share = mixed(self.share)
        if self.textures:
            (u, v), of = mixed(self.uv).T, self.texture[triangle]
            for index, texture in enumerate(self.textures):
                mine = of == index
                share[mine] *= texture.at(u[mine], v[mine])
        normal = facet if self.normals is None else mixed(self.normals)
        normal *= np.sign(np.einsum("pc,pc->p", normal, facet) + 1e-300)[:, None]
        normal = normal * -np.sign(np.einsum("pc,pc->p", facet, direction))[:, None]
        # a normal between vertices may face away where its triangle does not
        away = np.einsum("pc,pc->p", normal, direction)
        normal -= (away + 1e-6).clip(0)[:, None] * direction
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
        return normal, share

    @cached_property
    def _clear_m(self) -> float:
        return _CLEAR * float(np.linalg.norm(np.subtract(*self.box)))

    @cached_property
    def _facets(self) -> Points:
        """Unit normals (T, 3) of the triangles."""
        first, second, third = np.moveaxis(self.corners, 1, 0)
        normal = np.cross(second - first, third - first)
        facets: Points = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return facets

    @cached_property
    def _in_embree(self) -> tuple[Any, Points]:
        """Embree's tree, around the middle of the box, where single precision is finest."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        middle = np.mean(self.box, axis=0)
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, (self.corners - middle).astype(np.float32))
        return scene, middle
