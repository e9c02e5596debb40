"""Light that patches of surfaces give each other over plane mirrors, by images of the patches."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import ask
from transientcam_simulation.light._patches import Patches, contour
from transientcam_simulation.light._paths import at_panes, unobstructed
from transientcam_simulation.scene import Scene, Surface

_BLOCK = 1 << 18  # pairs of patches at a time


@dataclass(frozen=True)
class OverMirrors:
    """Form factors and distances of pairs of patches over chains of mirrors, receivers first."""

    to: NDArray[np.int32]
    by: NDArray[np.int32]
    factors: NDArray[np.float32]
    distance_m: NDArray[np.float32]

    @classmethod
    def of(cls, scene: Scene, patches: Patches) -> "OverMirrors":
        """Find what mirrors show to the middles of patches."""
        found: list[tuple[NDArray[Any], ...]] = []
        for bounces in range(1, scene.mirror_bounces + 1):
            for chain in product(scene.mirrors, repeat=bounces):
                if not any(
                    one.mirror.centre is other.mirror.centre for one, other in pairwise(chain)
                ):
                    found += _seen(scene, patches, chain)
        return cls(*map(np.concatenate, zip(*found, strict=True))) if found else NOTHING

    def add(
        self, in_phase: NDArray[np.float32], quadrature: NDArray[np.float32], frequency_hz: float
    ) -> None:
        """Add form factors, turned by their times of flight, to those of patches without."""
        phase = 2 * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S * self.distance_m
        np.add.at(in_phase, (self.to, self.by), self.factors * np.cos(phase))
        np.add.at(quadrature, (self.to, self.by), self.factors * np.sin(phase))

    def irradiance(self, given: NDArray[np.number], frequency_hz: float) -> NDArray[np.complex128]:
        """Moments (N) of what patches get of the radiosity that patches give."""
        turn = np.exp(2j * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S * self.distance_m)
        got, count = self.factors * turn * given[self.by], len(given)
        real, imag = (np.bincount(self.to, part, count) for part in (got.real, got.imag))
        irradiance: NDArray[np.complex128] = real + 1j * imag
        return irradiance


NOTHING = OverMirrors(*(np.zeros(0, kind) for kind in ("i4", "i4", "f4", "f4")))
"""Where there are no mirrors, or something moves."""


def _seen(
    scene: Scene, patches: Patches, chain: tuple[Surface, ...]
) -> Iterator[tuple[NDArray[Any], ...]]:
    """Yield pairs, receivers first, with form factors and distances, of a chain of mirrors."""
    images, corners, normal = [patches.centre], patches.corners, patches.normal
    there, reflectivity = np.ones(len(patches), dtype=bool), 1.0
    for each in reversed(chain):
        there &= each.mirror.in_front(images[0])
        images.insert(0, each.mirror.mirrored(images[0]))
        corners = each.mirror.mirrored(corners)[:, ::-1]  # counter-clockwise again
        normal = each.mirror.mirrored_direction(normal)
        reflectivity *= each.reflectivity if each.glass is None else 1.0
    those = np.flatnonzero(there)
    these = np.flatnonzero(chain[0].mirror.in_front(patches.centre))
    rows = max(1, _BLOCK // max(1, len(those)))
    for first in range(0, len(these), rows):
        ask()
        block = these[first : first + rows]
        way = images[0][those] - patches.centre[block, None]
        towards = np.einsum("pnc,pc->pn", way, patches.normal[block]) > 1e-9
        back = np.einsum("pnc,nc->pn", way, normal[those]) < -1e-9
        p, n = np.nonzero(towards & back)
        to, by = block[p], those[n]
        of_pairs = tuple(image[by] for image in images)
        clear = unobstructed(scene, chain, of_pairs, patches.centre[to])
        to, by, from_m = to[clear], by[clear], patches.centre[to[clear]]
        factors = reflectivity * contour(corners[by] - from_m[:, None], patches.normal[to])
        far_m = np.linalg.norm(images[0][by] - from_m, axis=-1)
        if scene.panes:
            share, later_m = at_panes(scene, chain, tuple(k[by] for k in images), from_m)
            factors, far_m = factors * share, far_m + later_m
        pairs = zip((to, by, factors, far_m), ("i4", "i4", "f4", "f4"), strict=True)
        yield tuple(each.astype(kind) for each, kind in pairs)
