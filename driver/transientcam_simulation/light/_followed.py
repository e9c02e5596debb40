"""Rays of a camera into a scene that stands still, each followed once whatever sequence asks."""

import threading
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._graded import graded
from transientcam_simulation.light._paths import Lit, joined, light_rays
from transientcam_simulation.light._rays import RAYS, camera_rays, rays_within
from transientcam_simulation.scene import Points, Scene


@dataclass(frozen=True, slots=True)
class Within:
    """The light of several rays in each of some pixels."""

    pixel: NDArray[np.intp]
    """(P) by index, rising."""
    rays: Lit
    """For each place in a pixel, all pixels."""

    def of_pixels(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return what belongs to the rays (..., R P) by place and pixel (..., R, P)."""
        return values.reshape((*values.shape[:-1], -1, self.pixel.size))

    def part(self, place: NDArray[np.intp]) -> "Within":
        """Return the rays in some of the pixels, by their places among these."""
        rays = np.arange(0, len(self.rays.surface), self.pixel.size)[:, None] + place
        return Within(self.pixel[place], self.rays.part(rays.ravel()))


class FollowedRays:
    """Light that rays through pixels see, as far as it was asked for; for any thread.

    Which pixels need several rays depends on the noise and the frequencies of a sequence; what one
    of these rays sees does not.

    ``scene``: standing still, with a camera.
    ``own``: rays (H W, 3) through the pixels, if not those through their centres.
    """

    def __init__(self, scene: Scene, own: Points | None = None, /, *, width: int, height: int):
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self.width, self.height = width, height
        self._camera = scene.camera
        self.centres = camera_rays(scene.camera, width=width, height=height) if own is None else own
        self._adding = threading.Lock()
        self._kept: dict[int, Within] = {}

    @cached_property
    def lit(self) -> Lit:
        """Light of one ray a pixel, (H W)."""
        return light_rays(self.scene, self.centres)

    @cached_property
    def exchange(self) -> Exchange:
        """Light that surfaces give each other."""
        return graded(self.scene, self.scene.transport.patches)

    def within(self, pixel: NDArray[np.intp], count: int = RAYS) -> Within:
        """Return the light of several rays in each pixel.

        ``pixel``: (P) by index, rising, none twice; at least one.
        ``count``: of rays in each pixel.
        """
        with self._adding:
            kept = self._kept.get(count)
            more = pixel
            if kept is not None:
                more = np.setdiff1d(pixel, kept.pixel, assume_unique=True)
            if more.size:
                size = {"width": self.width, "height": self.height}
                rays = rays_within(self._camera, more, count, **size)
                added = Within(more, light_rays(self.scene, rays))
                kept = self._kept[count] = added if kept is None else _both(kept, added)
            assert kept is not None  # noqa: S101  (what was missing was added)
            if pixel.size == kept.pixel.size:
                return kept
            return kept.part(np.searchsorted(kept.pixel, pixel))


def _both(one: Within, other: Within) -> Within:
    """Join the rays in some pixels and those in others, by rising index."""
    pixel = np.concatenate([one.pixel, other.pixel])
    joined = _side_by_side(one.rays, one.pixel.size, other.rays, other.pixel.size)
    return Within(pixel, joined).part(np.argsort(pixel, kind="stable"))


def _side_by_side(one: Lit, pixels: int, other: Lit, more: int) -> Lit:
    """Join the rays in some pixels and those in others, place by place."""
    count = len(one.surface)
    first = np.arange(count).reshape(-1, pixels)
    second = count + np.arange(len(other.surface)).reshape(-1, more)
    return joined([one, other]).part(np.concatenate([first, second], axis=1).ravel())
