"""Pixels at edges: the mean over several rays in a pixel, not the one through its centre."""

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.paths import Lit, light_rays, rays_through
from transientcam_driver.simulation.responses import Responses, Scatter, SparseResponses
from transientcam_driver.simulation.scene import Scene

_JUMP = 0.03  # of the range, from one pixel to the next: an edge


class WithMixedPixels:
    """Responses some of whose pixels are replaced by the mean over several rays.

    Parameters
    ----------
    base
        The responses of all pixels.
    at
        Rows and columns of those to replace.
    lit, scatter
        Light of the rays: for each place in a pixel, all of these pixels.
    """

    def __init__(
        self,
        base: Responses,
        at: tuple[NDArray[np.intp], NDArray[np.intp]],
        lit: Lit,
        scatter: Scatter | None,
    ) -> None:
        self._base = base
        self._at = at
        self._lit = lit
        self._scatter = scatter

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Kind of the base."""
        return self._base.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Moments of the base, except of the pixels replaced."""
        moments = self._base.moments(frequency_hz)
        of_rays = self._lit.moments(frequency_hz, self._scatter).reshape(-1, len(self._at[0]))
        moments[self._at] = of_rays.mean(axis=0)
        return moments

    @cached_property
    def _mixed(self) -> SparseResponses:
        """The pixels replaced, as an image of one row: a plane for each ray and path."""
        count = len(self._at[0])
        paths, rays = len(self._lit.weight), self._lit.weight.shape[1] // count
        scatter = self._scatter
        if scatter is not None:
            scatter = Scatter(
                np.tile(scatter.width_s.reshape(rays, count), (paths, 1))[:, None],
                np.tile(scatter.decay_s.reshape(rays, count), (paths, 1))[:, None],
            )
        planes = (-1, 1, count)
        delay_s, weight = self._lit.delay_s.reshape(planes), self._lit.weight.reshape(planes)
        return SparseResponses(delay_s, weight / rays, scatter)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """All returns; as many planes as the pixel with the most returns needs."""
        delay_s, weight = self._base.returns()
        more_s, more = self._mixed.returns()
        there = max(len(delay_s), int(np.sum(more > 0, axis=0).max(initial=0)))
        shape = (there, *delay_s.shape[1:])
        all_s, all_weight = np.full(shape, np.nan), np.zeros(shape)
        all_s[: len(delay_s)], all_weight[: len(weight)] = delay_s, weight
        rows, columns = self._at
        all_s[:, rows, columns], all_weight[:, rows, columns] = np.nan, 0.0
        several = min(there, len(more_s))
        all_s[:several, rows, columns] = more_s[:several, 0]
        all_weight[:several, rows, columns] = more[:several, 0]
        return all_s, all_weight

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Response of the base, or of the rays in a pixel that is replaced."""
        mine = np.flatnonzero((self._at[0] == y) & (self._at[1] == x))
        return self._mixed.of_pixel(int(mine[0]), 0) if mine.size else self._base.of_pixel(x, y)


def with_mixed_pixels(
    scene: Scene,
    distance_m: NDArray[np.float64],
    responses: Responses,
    *,
    rays: tuple[tuple[float, float], ...],
) -> Responses:
    """Replace pixels at edges by the mean over several rays in them."""
    height, width = distance_m.shape
    rows, columns = np.nonzero(edges(distance_m)[0])
    if not rows.size:
        return responses
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    # ray by ray over the places in a pixel, then pixel by pixel
    right, down = np.array(rays).T[:, :, None]
    through = rays_through(
        scene.camera, (columns + right).ravel(), (rows + down).ravel(), width=width, height=height
    )
    fine = light_rays(scene, through)
    return WithMixedPixels(responses, (rows, columns), fine, fine.scatter(scene))


def edges(distance_m: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Pixels (H, W) at a jump of range, and the steps in m; 0 m stands for a ray without an end."""
    edge = np.zeros(distance_m.shape, dtype=bool)
    steps: list[NDArray[np.float64]] = []
    for axis in (0, 1):
        near = np.take(distance_m, range(distance_m.shape[axis] - 1), axis)
        far = np.take(distance_m, range(1, distance_m.shape[axis]), axis)
        step = np.abs(near - far)
        jump = (step > _JUMP * np.minimum(near, far)) & (near > 0) & (far > 0)
        steps.append(step[jump])
        first = [slice(None)] * 2
        second = [slice(None)] * 2
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        edge[tuple(first)] |= jump
        edge[tuple(second)] |= jump
    return edge, np.concatenate(steps)
