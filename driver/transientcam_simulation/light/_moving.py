"""Light in a scene some of whose surfaces move.

What stands still is traced once. At each time only what the moving surfaces change is computed: the
pixels that show one of them, by the share of the pixel that it covers, and the ways of light that
it blocks. Everything follows the device's time without steps.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import IMAGE_KERNELS
from transientcam_simulation.light import (
    _compiled_chunks as compiled_chunks,
    _compiled_overlaps as compiled_overlaps,
)
from transientcam_simulation.light._bundle import Bundle, Region, inside, numbers, overlap, union
from transientcam_simulation.light._coverage import Plane
from transientcam_simulation.light._held_light import HeldLight
from transientcam_simulation.light._hit_points import Ends
from transientcam_simulation.light._layers import Layers, MovingResponses, Shadow, uncovered_by
from transientcam_simulation.light._paths import ImageLight, image_lights
from transientcam_simulation.light._shares import (
    alone,
    around,
    grown_tiles,
    meeting,
    seen,
    shade,
    shown_tiles,
)
from transientcam_simulation.light._still import Sight, StillLight, segments
from transientcam_simulation.scene import Primitive, Scene


@dataclass(frozen=True, slots=True)
class _VisibleSurface:
    """A surface that moves, where the camera sees it: shares (h, w) of the pixels of a region."""

    index: int
    sight: Sight
    region: Region
    share: Plane
    at_m: Plane

    @property
    def count(self) -> int:
        """How many pixels show it."""
        return int(np.count_nonzero(self.share))

    def put_points(self, start: int, places: NDArray[np.int32], lines: NDArray[np.float32]) -> None:
        """Put what is known of its pixels into the columns from one on.

        Rows and columns (2, P); shares, distances, and points and ways by component (8, P).
        """
        bundle, corner = self.sight.bundle, numbers(self.region)[:2]
        apex = bundle.apex.astype(np.float32)
        compiled_chunks.points(
            self.share, self.at_m, *bundle.way, *corner, apex, start, places, lines
        )


class MovingLight:
    """The light of a scene at any time.

    ``scene``: with moving surfaces that scatter light.
    ``still``: light of what stands still (see ``still_scene``).
    ``soft``: whether pixels that a silhouette or a shadow crosses take a share of it.
    """

    def __init__(self, scene: Scene, still: StillLight, *, soft: bool) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self.still = still
        self._soft = soft
        IMAGE_KERNELS.want()
        self._movers = tuple(k for k, each in enumerate(scene.surfaces) if each.motions)
        self._lights = tuple(image_lights(scene))
        self._sights = still.lines_of_sight(soft=soft)
        self._chains = tuple(
            tuple(self._light_segments(k, light)) for k, light in enumerate(self._lights)
        )

    def at(self, time_s: float, held: HeldLight | None = None) -> MovingResponses:
        """Impulse responses at a time; moments with light over several surfaces, if it is given."""
        scene = self.scene.at(time_s)
        shapes = [scene.surfaces[k].primitive for k in self._movers]
        found = [each for sight in self._sights for each in self._cover(shapes, sight)]
        visible = self._visible(found)
        layers = self._lit(scene, visible) if visible else None
        uncovered = uncovered_by(layers, (self.still.height, self.still.width))
        shows = shown_tiles(uncovered)
        shadows = [
            shadow for k in range(len(self._chains)) if (shadow := self._shadow(shapes, k, shows))
        ]
        region = union([*(each.region for each in visible), *(each.region for each in shadows)])
        return MovingResponses(self.still, scene, layers, uncovered, shadows, region, held)

    def _cover(self, shapes: list[Primitive], sight: Sight) -> Iterator[_VisibleSurface]:
        """Shares of pixels that surfaces cover, where nothing that stands still is before them."""
        bundle = sight.bundle
        _tiles, regions = meeting(shapes, bundle)
        for index, shape, region in zip(self._movers, shapes, regions, strict=True):
            if region is None:
                continue
            share, at_m = seen(shape, bundle, region, sight.fills, soft=self._soft)
            if share.any():
                yield _VisibleSurface(index, sight, region, share, at_m)

    def _visible(self, found: list[_VisibleSurface]) -> list[_VisibleSurface]:
        """Take from each share what nearer surfaces that move cover of it; leave out the hidden."""
        left = [each.share.copy() for each in found]
        for k, one in enumerate(found):
            for other, share in zip(found[k + 1 :], left[k + 1 :], strict=True):
                both = overlap(one.region, other.region)
                if both is None:
                    continue
                mine, its = inside(both, one.region), inside(both, other.region)
                compiled_overlaps.hide(
                    one.share[mine], one.at_m[mine], left[k][mine],
                    other.share[its], other.at_m[its], share[its], self._soft,
                )  # fmt: skip
        shown = zip(found, left, strict=True)
        return [replace(each, share=share) for each, share in shown if share.any()]

    def _lit(self, scene: Scene, visible: list[_VisibleSurface]) -> Layers:
        """Light the parts of surfaces that are seen, all at once."""
        counts = [each.count for each in visible]
        ends = np.cumsum([0, *counts]).tolist()
        places, lines = np.empty((2, ends[-1]), np.int32), np.empty((8, ends[-1]), np.float32)
        for start, each in zip(ends, visible, strict=False):
            each.put_points(start, places, lines)
        share, at_m, *components = lines
        region = union([each.region for each in visible])
        lit = Ends(
            scene,
            scene.surfaces,
            np.repeat(np.array([each.index for each in visible], np.int32), counts),
            (components[0], components[1], components[2]),
            at_m,
            (components[3], components[4], components[5]),
            np.repeat([each.sight.throughput for each in visible], counts),
            np.array([each.shape.box for each in scene.surfaces]),
        ).lit(
            self._lights,
            movers=self._movers,
            around=around(places[0], places[1], region) if self._soft else alone(ends[-1]),
        )
        parts = tuple(slice(*pair) for pair in pairwise(ends))
        return Layers(places, share, lit, parts)

    def _shadow(
        self, shapes: list[Primitive], chain: int, shows: NDArray[np.bool_]
    ) -> Shadow | None:
        """Share of the light by a chain of mirrors that is left on what stands still.

        Only near tiles that show any of it: each shape takes light at the edge of another one by
        what is left of it in the pixels beside, so that shares depend on as many pixels around.
        """
        bundles = self._chains[chain]
        if not bundles:
            return None
        left = np.ones((self.still.height, self.still.width), dtype=np.float32)
        near = grown_tiles(shows, 1 + len(bundles) * len(shapes))
        regions: list[Region] = []
        for bundle in bundles:
            regions += shade(shapes, bundle, left, near, soft=self._soft)
        if not regions:
            return None
        return Shadow(chain, union(regions), left)

    def _light_segments(self, chain: int, light: ImageLight) -> list[Bundle]:
        """Ways of light to what stands still, where it arrives, one bundle a segment."""
        on, point = self.still.lit_by(chain)
        if not on.any():
            return []
        return segments(light, point, on.reshape(self.still.height, self.still.width))
