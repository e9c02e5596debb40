"""Light that patches of surfaces give each other over plane mirrors, by images of the patches."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.base import ask
from transientcam_simulation.light._patches import Patches, contour
from transientcam_simulation.light._paths import blocked
from transientcam_simulation.scene import Points, Rectangle, Scene

_BLOCK = 1 << 18  # pairs of patches at a time


@dataclass(frozen=True, slots=True)
class _Images:
    """Patches in a chain of mirrors, the one that shows them to the receiver first.

    ``centres`` are their images in all mirrors, in all but the first, ..., and they themselves;
    ``corners`` and ``normal`` those of the whole chain.
    """

    mirrors: tuple[Rectangle, ...]
    reflectivity: float
    centres: tuple[Points, ...]
    corners: Points
    normal: Points
    there: NDArray[np.bool_]


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
        chains = _images(scene, patches)
        found = [pairs for images in chains for pairs in _seen(scene, patches, images)]
        if not found:
            return NOTHING
        return cls(*(np.concatenate(each) for each in zip(*found, strict=True)))

    def irradiance(
        self, given: NDArray[np.complexfloating], frequency_hz: float
    ) -> NDArray[np.complex128]:
        """Moments (N) of what patches get of the radiosity that patches give."""
        turn = np.exp(2j * np.pi * frequency_hz / SPEED_OF_LIGHT_M_S * self.distance_m)
        got, count = self.factors * turn * given[self.by], len(given)
        irradiance: NDArray[np.complex128] = np.bincount(
            self.to, got.real, count
        ) + 1j * np.bincount(self.to, got.imag, count)
        return irradiance


NOTHING = OverMirrors(*(np.zeros(0, kind) for kind in ("i4", "i4", "f4", "f4")))
"""Where there are no mirrors."""


def _images(scene: Scene, patches: Patches) -> Iterator[_Images]:
    """Yield the patches in every chain of mirrors that light may pass."""
    mirrors = [each for each in scene.surfaces if each.kind == "mirror"]
    every = np.ones(len(patches), dtype=bool)
    chains = [_Images((), 1.0, (patches.centre,), patches.corners, patches.normal, every)]
    for _bounce in range(scene.mirror_bounces):
        chains = [
            _Images(
                (each.mirror, *chain.mirrors),
                chain.reflectivity * each.reflectivity,
                (each.mirror.mirrored(chain.centres[0]), *chain.centres),
                each.mirror.mirrored(chain.corners)[:, ::-1],  # counter-clockwise again
                each.mirror.mirrored_direction(chain.normal),
                chain.there & each.mirror.in_front(chain.centres[0]),
            )
            for chain in chains
            for each in mirrors
            if not any(each.mirror is last for last in chain.mirrors[:1])
        ]
        yield from (chain for chain in chains if chain.there.any())


def _seen(scene: Scene, patches: Patches, images: _Images) -> Iterator[tuple[NDArray[Any], ...]]:
    """Yield pairs, receivers first, with form factors and distances, of a chain of mirrors."""
    those = np.flatnonzero(images.there)
    these = np.flatnonzero(images.mirrors[0].in_front(patches.centre))
    rows = max(1, _BLOCK // len(those))
    for first in range(0, len(these), rows):
        ask()
        block = these[first : first + rows]
        way = images.centres[0][those] - patches.centre[block, None]
        towards = np.einsum("pnc,pc->pn", way, patches.normal[block]) > 1e-9
        back = np.einsum("pnc,nc->pn", way, images.normal[those]) < -1e-9
        p, n = np.nonzero(towards & back)
        to, by = block[p], those[n]
        clear = _clear(scene, images, patches.centre[to], by)
        to, by = to[clear], by[clear]
        from_m = patches.centre[to]
        factors = contour(images.corners[by] - from_m[:, None], patches.normal[to])
        factors *= images.reflectivity
        far_m = np.linalg.norm(images.centres[0][by] - from_m, axis=-1)
        pairs = (each.astype(np.int32) for each in (to, by))
        yield *pairs, *(each.astype(np.float32) for each in (factors, far_m))


def _clear(scene: Scene, images: _Images, at: Points, patch: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the pairs, by index, whose way over the mirrors is free."""
    left, stops = np.arange(len(at)), [at]
    for mirror, centre in zip(images.mirrors, images.centres, strict=False):
        start, end = stops[-1], centre[patch[left]]
        fraction = mirror.hit(start, end)
        on = (fraction < 1) & mirror.in_front(start)
        left, stops = left[on], [stop[on] for stop in stops]
        stops.append(stops[-1] + fraction[on, None] * (end[on] - stops[-1]))
    stops.append(images.centres[-1][patch[left]])
    free = np.ones(len(left), dtype=bool)
    for start, end in pairwise(stops):
        free &= ~blocked(scene, start, end)
    return left[free]
