"""Rays of a camera into a scene that stands still, each followed once whatever sequence asks."""

import threading
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.exchange import Exchange
from transientcam_driver.simulation.light.paths import Lit, light_rays
from transientcam_driver.simulation.light.rays import RAYS, camera_rays, rays_within
from transientcam_driver.simulation.scene.scene import Scene


class FollowedRays:
    """Light that rays through pixels see, as far as it was asked for; for any thread.

    Which pixels need several rays depends on the noise and the frequencies of a sequence; what one
    of these rays sees does not.

    Parameters
    ----------
    scene
        Standing still, with a camera.
    """

    def __init__(self, scene: Scene, *, width: int, height: int) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self.width, self.height = width, height
        self._camera = scene.camera
        self.centres = camera_rays(self._camera, width=width, height=height)
        self._adding = threading.Lock()
        self._pixel = np.zeros(0, dtype=np.intp)
        self._within: Lit | None = None

    @cached_property
    def lit(self) -> Lit:
        """Light of one ray a pixel, (H W)."""
        return light_rays(self.scene, self.centres)

    @cached_property
    def exchange(self) -> Exchange:
        """Light that surfaces give each other."""
        return Exchange.of(self.scene, self.scene.transport.patches)

    def within(self, pixel: NDArray[np.intp], count: int = RAYS) -> Lit:
        """Return the light of several rays in each pixel: for each place, all pixels.

        Parameters
        ----------
        pixel
            (P) by index, rising, none twice; at least one.
        count
            Of rays in each pixel; the same in all calls.
        """
        with self._adding:
            more = np.setdiff1d(pixel, self._pixel, assume_unique=True)
            if more.size:
                size = {"width": self.width, "height": self.height}
                added = light_rays(self.scene, rays_within(self._camera, more, count, **size))
                self._insert(more, added)
            assert self._within is not None  # noqa: S101  (what was missing was added)
            if pixel.size == self._pixel.size:
                return self._within
            return _of_pixels(self._within, np.searchsorted(self._pixel, pixel), self._pixel.size)

    def _insert(self, pixel: NDArray[np.intp], added: Lit) -> None:
        """Keep the light of more pixels, by rising index."""
        if self._within is None:
            self._pixel, self._within = pixel, added
            return
        order = np.argsort(np.concatenate([self._pixel, pixel]), kind="stable")
        both = _side_by_side(self._within, self._pixel.size, added, pixel.size)
        self._within = _of_pixels(both, order, order.size)
        self._pixel = np.concatenate([self._pixel, pixel])[order]


def _of_pixels(lit: Lit, place: NDArray[np.intp], pixels: int) -> Lit:
    """Return the rays in some of the pixels, by their places among so many."""
    rays = np.arange(0, len(lit.surface), pixels)[:, None] + place
    return lit.part(rays.ravel())


def _side_by_side(one: Lit, pixels: int, other: Lit, more: int) -> Lit:
    """Join the rays in some pixels and those in others, place by place."""
    merged = {}
    for name in Lit.__slots__:
        first, second = getattr(one, name), getattr(other, name)
        axis = 1 if name in ("delay_s", "weight") else 0  # of the rays
        shape, inner = first.shape[:axis], first.shape[axis + 1 :]
        parts = (
            first.reshape(*shape, -1, pixels, *inner),
            second.reshape(*shape, -1, more, *inner),
        )
        joined = np.concatenate(parts, axis=axis + 1)
        merged[name] = joined.reshape(*shape, -1, *inner)
    return Lit(**merged)
