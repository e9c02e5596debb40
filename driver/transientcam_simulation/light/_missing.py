"""Light that a scene has and the simulation does not follow, sized by a few thousand paths.

A path starts where the ray through a pixel's centre ends, and is sent on at random by a few more
surfaces, each of which takes the lamp's light, straight and over mirrors. What it brings counts
for the kind of way it took: over a mirror between two scattering surfaces, by gloss of anything
but the lamp, over more surfaces than the scene's file allows, from or to a mesh, or as radiosity
follows it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import ask
from transientcam_simulation.effects import Glimpse, Values
from transientcam_simulation.light._graded import graded
from transientcam_simulation.light._over_gloss import around, of_surfaces, sent_by_gloss
from transientcam_simulation.light._paths import (
    RayEnds,
    first_scattering,
    highlight,
    image_lights,
    light_on,
    light_rays,
    some,
)
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._variants import without_scattering
from transientcam_simulation.scene import Mesh, Points, Rectangle, Scene

PIXELS = 64
"""At all times of a scene's life together."""
_PATHS = 512  # in each of two halves, by pixel
_FURTHER = 3  # surfaces behind the one that is seen
_PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])  # even places in two dimensions
_SURE = 3.0  # standard errors by which patches must differ from paths
_FIRST, _FOLLOWED, _MIRRORS, _GLOSS, _BOUNCES, _MESHES = range(6)  # ``_FIRST`` by radiosity, too
_KINDS = {
    "mirrors-between": _MIRRORS,
    "gloss-of-surroundings": _GLOSS,
    "further-bounces": _BOUNCES,
    "between-meshes": _MESHES,
}


@dataclass(frozen=True)
class SampledWays:
    """Light that paths bring to some pixels: by pixel and half of the paths, and by kind.

    ``rays`` (P, 3) go through the pixels' centres; ``slot`` (N) is the pixel's index, and P more in
    the second half of the paths, ``length_m`` the whole way, and ``weight`` the brightness.
    """

    scene: Scene
    rays: Points
    slot: NDArray[np.intp]
    length_m: Values
    weight: Values
    kind: NDArray[np.intp]

    @classmethod
    def of(
        cls, scene: Scene, rays: Points, *, paths: int = _PATHS, moves: bool = False
    ) -> "SampledWays":
        """Follow so many random paths from where each ray of the camera ends, twice.

        ``moves``: surfaces of which some move give each other no light over mirrors.
        """
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        pixels, random = len(rays), np.random.default_rng(0)
        ends = first_scattering(scene, scene.camera.position_m, rays)
        # each half has places of its own for the first direction, shifted for each pixel
        shifts = random.random((len(ends.ray), 2, 1, 2))
        places = ((shifts + np.arange(paths)[:, None] * _PLASTIC) % 1.0).reshape(-1, 2)
        ends = some(ends, np.repeat(np.arange(len(ends.ray)), 2 * paths))
        slot = ends.ray + pixels * (np.arange(len(ends.ray)) // paths % 2)
        length_m, weight = ends.distance_m, ends.throughput / paths
        curved = np.array([not isinstance(each.shape, Rectangle) for each in scene.surfaces])
        meshes = np.array([isinstance(each.shape, Mesh) for each in scene.surfaces])
        over, glossy, of_mesh = np.zeros((3, len(slot)), dtype=bool)
        lights, most = tuple(image_lights(scene)), scene.transport.diffuse_bounces
        found: list[tuple[NDArray[np.intp], Values, Values, NDArray[np.intp]]] = []
        for further in range(1, _FURTHER + 1):
            ask()
            way, factor, lobe = _sent_on(scene, ends, places, random.random(len(slot)))
            leaves = meshes[ends.surface]
            sent = weight * factor
            goes = np.flatnonzero(sent > 0)
            ends = first_scattering(scene, ends.point[goes] + 1e-9 * way[goes], way[goes])
            if scene.panes:  # which part paths: by chance so many go on as light is left
                left = ends.throughput * (ends.albedo + of_surfaces(scene, "gloss")[ends.surface])
                kept = np.flatnonzero(random.random(len(left)) < left)
                ends = some(ends, kept)
                ends.throughput[:] /= left[kept]
            on = goes[ends.ray]
            # a mirror turns rays
            over, glossy = over[on] | (ends.direction != way[on]).any(axis=1), glossy[on] | lobe[on]
            of_mesh = of_mesh[on] | (~lobe[on] & (leaves[on] | meshes[ends.surface]))
            slot, weight, length_m = slot[on], sent[on], length_m[on] + ends.distance_m
            albedo = ends.throughput * ends.albedo
            cut = _BOUNCES if most is not None and further > most else min(further - 1, _FOLLOWED)
            kind = np.full(len(slot), cut)
            kind[of_mesh] = _MESHES
            if moves:
                kind = np.where(glossy, _GLOSS, np.where(over, _MIRRORS, kind))
            for light in lights:
                far_m, irradiance = light_on(scene, light, ends.point, ends.normal)
                gloss = highlight(scene, light, ends)
                shines = np.where(moves | curved[ends.surface], _GLOSS, kind)
                for sends, by in ((albedo, kind), (gloss, shines)):
                    brings = weight * irradiance * sends
                    lit = brings > 0
                    found.append((slot[lit], length_m[lit] + far_m[lit], brings[lit], by[lit]))
            weight = weight * ends.throughput
            places = random.random((len(slot), 2))
        joined = [np.concatenate(each) for each in zip(*found, strict=True)]
        return cls(scene, rays, joined[0], joined[1], joined[2], joined[3])

    @property
    def followed(self) -> Values:
        """Brightness (P) of light that radiosity follows."""
        both = self._moments(_FIRST, 0.0) + self._moments(_FOLLOWED, 0.0)
        return np.asarray(both.real.mean(axis=0))

    def change(self, kind: str, frequencies_hz: tuple[float, ...]) -> Values:
        """Size (P) of the moments that are missing, at most."""
        if kind == "coarse-patches":
            return self._by_patches(max(frequencies_hz))
        sizes = [self._moments(_KINDS[kind], each) for each in frequencies_hz]
        power = np.max([_power(one, other) for one, other in sizes], axis=0)
        return np.asarray(np.sqrt(power.clip(0)))

    def _moments(self, kind: int, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments (2, P) of pixels by each half of the paths, which know nothing of each other."""
        mine, pixels = self.kind == kind, len(self.rays)
        phase = 2 * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S * self.length_m[mine]
        real, imag = (
            np.bincount(self.slot[mine], self.weight[mine] * part, 2 * pixels)
            for part in (np.cos(phase), np.sin(phase))
        )
        halves: NDArray[np.complex128] = (real + 1j * imag).reshape(2, pixels)
        return halves

    def _by_patches(self, frequency_hz: float) -> Values:
        """Difference (P) of radiosity from paths, by the first bounce; 0 where they cannot tell."""
        if not (self.kind == _FIRST).any():
            return np.zeros(len(self.rays))
        once = replace(self.scene.transport, diffuse_bounces=1)
        scene = without_scattering(replace(self.scene, transport=once))
        lit = light_rays(scene, self.rays)
        exchange = graded(scene, scene.transport.patches)
        patches = Interreflection(
            scene, lit, width=len(lit.surface), height=1, exchange=exchange, rays=self.rays
        )
        seen = patches.moments(frequency_hz)[0]
        one, other = self._moments(_FIRST, frequency_hz)
        power = _power(one - seen, other - seen)
        error = np.abs(one - other) ** 2 / 4
        of_all = self.followed.sum() / self._moments(_FIRST, 0.0).real.mean(axis=0).sum()
        return np.asarray(of_all * np.sqrt(np.where(power > _SURE**2 * error.mean(), power, 0.0)))


def sampled_glimpses(
    scenes: tuple[Scene, ...], rays: list[Points], seen: tuple[Glimpse, ...], *, moves: bool
) -> tuple[tuple[SampledWays, ...], tuple[Glimpse, ...]]:
    """Sample scenes at some times: of the pixels judged then, by their rays, a few drawn once."""
    count = min(len(rays[0]), PIXELS // len(seen))
    some = np.sort(np.random.default_rng(1).choice(len(rays[0]), count, replace=False))
    ways = tuple(
        SampledWays.of(scene, of[some], moves=moves) for scene, of in zip(scenes, rays, strict=True)
    )
    parts = zip((each.brightness[some] for each in seen), ways, strict=True)
    bright = [direct + each.followed for direct, each in parts]
    return ways, tuple(
        Glimpse(light, each.reflectance[some], each.cosine[some], (1, count))
        for light, each in zip(bright, seen, strict=True)
    )


def _power(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> Values:
    """Square of a magnitude, without what the error of either estimate would add to it."""
    return np.asarray((one * np.conj(other)).real)


def _sent_on(
    scene: Scene, ends: RayEnds, places: Values, choice: Values
) -> tuple[Points, Values, NDArray[np.bool_]]:
    """Directions, the share of light that goes on so, and whether gloss sends it."""
    albedo, gloss = ends.albedo, of_surfaces(scene, "gloss")[ends.surface]
    part = np.divide(gloss, albedo + gloss, out=np.zeros(len(gloss)), where=gloss > 0)
    lobe = choice < part
    way = around(ends.normal, np.sqrt(places[:, 0]), places[:, 1])
    share = albedo / np.maximum(1 - part, 1e-12)
    mirrored, of_lobe = sent_by_gloss(scene, ends, places)
    way[lobe], share[lobe] = mirrored[lobe], of_lobe[lobe] / part[lobe]
    return way, share, lobe
