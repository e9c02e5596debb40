"""Light in a scene some of whose surfaces move.

What stands still is traced once. At each time only what the moving surfaces change is computed:
the rays of the camera that end on one of them, and the paths of light that they block.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.paths import (
    ImageLight,
    Lit,
    RayEnds,
    first_scattering,
    image_lights,
    light_on_ends,
    light_rays,
)
from transientcam_driver.simulation.light.paths import sparse as sparse_of
from transientcam_driver.simulation.responses import SparseResponses
from transientcam_driver.simulation.scene.geometry import Ellipsoid, Points, Shape
from transientcam_driver.simulation.scene.scene import Scene

_FAR_M = 1e3  # longer than any path in a scene
_END = 1 - 1e-5  # of a segment, in single precision
_START = 1e-5
_PIXELS = 1.0  # that the fastest surface may move before the scene is computed again


class _Segments:
    """Fixed segments, intersected with a shape at many places.

    What does not depend on the place of an ellipsoid is computed once.
    """

    def __init__(self, index: NDArray[np.intp], start: Points, end: Points) -> None:
        self.index = index
        self._start, self._end = start, end
        self._of_radii: dict[tuple[float, ...], tuple[NDArray[np.float32], ...]] = {}

    def hit(self, shape: Shape) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the segments that the shape blocks by index, and the fraction of their length."""
        if not isinstance(shape, Ellipsoid):
            at = shape.hit(self._start, self._end)
            near = np.flatnonzero(at < _END)
            return near, at[near]
        key = tuple(shape.radii.tolist())
        if key not in self._of_radii:
            origin, direction = self._start / shape.radii, (self._end - self._start) / shape.radii
            parts = (
                origin,
                direction,
                np.einsum("nc,nc->n", direction, direction),
                np.einsum("nc,nc->n", origin, direction),
                np.einsum("nc,nc->n", origin, origin) - 1,
            )
            self._of_radii[key] = tuple(part.astype(np.float32) for part in parts)
        start, way, a, along, beyond = self._of_radii[key]
        centre = (shape.centre / shape.radii).astype(np.float32)
        # |start + fraction way - centre| = 1
        b = along - way @ centre
        c = beyond - start @ (2 * centre)
        c += centre @ centre
        discriminant = b * b
        discriminant -= a * c
        near = np.flatnonzero(discriminant > 0)
        first = -(b[near] + np.sqrt(discriminant[near])) / a[near]
        between = (first > _START) & (first < _END)
        return near[between], first[between].astype(np.float64)

    def exact(self, shape: Shape, chosen: NDArray[np.intp]) -> NDArray[np.float64]:
        """Fraction of some segments in double precision."""
        at = shape.hit(self._start[chosen], self._end[chosen])
        return np.where(at < 1, at, 1.0)  # grazing rays may differ between precisions


class MovingLight:
    """The light of a scene at any time.

    Parameters
    ----------
    scene
        With moving surfaces that scatter light.
    directions
        (H W, 3) rays of the camera.
    """

    def __init__(self, scene: Scene, directions: Points, *, width: int, height: int) -> None:
        assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
        self.scene = scene
        self._directions = directions
        self._width, self._height = width, height
        # surfaces keep their indices; what moves is put far below while the rest is traced
        self._movers = tuple(k for k, each in enumerate(scene.surfaces) if each.motions)
        self._still_scene = replace(
            scene,
            surfaces=tuple(
                replace(each, shape=each.shape.moved(np.array([0.0, 0.0, -1e6])), motions=())
                if each.motions
                else each
                for each in scene.surfaces
            ),
        )
        self.still = light_rays(self._still_scene, directions)
        self._lights = tuple(image_lights(scene))
        self._chains = tuple(
            tuple(self._light_segments(k, light)) for k, light in enumerate(self._lights)
        )
        self._reach_m = np.zeros(len(directions))
        self._sight = self._lines_of_sight()
        self._phasors: dict[float, tuple[NDArray[np.complex64], NDArray[np.complex128]]] = {}
        self.step_s = self._step_s(directions, width)

    def tick_s(self, time_s: float) -> float:
        """Return the last multiple of ``step_s``."""
        return float(np.floor(time_s / self.step_s + 1e-9) * self.step_s)

    def at(self, time_s: float) -> "MovingResponses":
        """Impulse responses at a time."""
        scene = self.scene.at(time_s)
        assert scene.camera is not None  # noqa: S101  (checked when made)
        shapes = {index: scene.surfaces[index].shape for index in self._movers}
        straight, *by_mirrors = self._sight
        nearest = np.full(len(self._directions), np.inf)
        which = np.full(len(self._directions), -1)
        for index, shape in shapes.items():
            rays, at = straight.hit(shape)
            closer = at < nearest[rays]
            nearest[rays[closer]], which[rays[closer]] = at[closer], index
        front = np.flatnonzero(which >= 0)
        for index, shape in shapes.items():  # in double precision, or points shade themselves
            mine = np.flatnonzero(which == index)
            nearest[mine] = straight.exact(shape, mine)
        ends = self._in_front(scene, front, which[front], nearest[front])
        over = np.zeros(len(self._directions), dtype=bool)
        for segments in by_mirrors:
            for shape in shapes.values():
                over[segments.index[segments.hit(shape)[0]]] = True
        over[front] = False
        mirrored = np.flatnonzero(over)
        if mirrored.size:
            eye = scene.camera.position_m
            ends = ends.with_more(first_scattering(scene, eye, self._directions[mirrored]), front)
            front = np.concatenate([front, mirrored])
        lit = light_on_ends(scene, self._lights, ends, rays=len(front))
        hidden = np.zeros(len(self._directions), dtype=bool)
        hidden[front] = True
        shadows = []
        for chain in self._chains:
            dark = np.zeros(len(self._directions), dtype=bool)
            for segments in chain:
                for shape in shapes.values():
                    dark[segments.index[segments.hit(shape)[0]]] = True
            shadows.append(np.flatnonzero(dark & ~hidden))
        return MovingResponses(self, scene, front, lit, tuple(shadows))

    def _in_front(
        self,
        scene: Scene,
        front: NDArray[np.intp],
        surface: NDArray[np.intp],
        at: NDArray[np.float64],
    ) -> RayEnds:
        """Return the ends of rays on moving surfaces that the camera sees without a mirror."""
        assert scene.camera is not None  # noqa: S101  (checked when made)
        distance_m = at * self._reach_m[front]
        point = scene.camera.position_m + distance_m[:, None] * self._directions[front]
        count = len(front)
        return RayEnds(np.arange(count), point, surface, distance_m, np.ones(count))

    def phasors(self, frequency_hz: float) -> tuple[NDArray[np.complex64], NDArray[np.complex128]]:
        """Moments of what stands still: (K, H W) by chain of mirrors, and (H W) in all."""
        if frequency_hz not in self._phasors:
            phase_rad = 2 * np.pi * frequency_hz * self.still.delay_s
            each = self.still.weight * np.exp(1j * phase_rad)
            scatter = self.still.scatter(self.scene)
            if scatter is not None:
                each = each * scatter.transfer(frequency_hz)
            self._phasors[frequency_hz] = each.astype(np.complex64), each.sum(axis=0)
        return self._phasors[frequency_hz]

    def _light_segments(self, chain: int, light: ImageLight) -> list[_Segments]:
        """Segments of the paths of light to what stands still, where it arrives."""
        index = np.flatnonzero(self.still.weight[chain])
        if not index.size:
            return []
        segments, start = [], self.still.point[index]
        for mirror, image_m in zip(light.mirrors, light.positions_m, strict=False):
            fraction = mirror.shape.hit(start, np.broadcast_to(image_m, start.shape))
            end = start + fraction[:, None] * (image_m - start)
            segments.append(_Segments(index, start, end))
            start = end
        lamp = np.broadcast_to(light.positions_m[-1], start.shape)
        return [*segments, _Segments(index, start, lamp)]

    def _lines_of_sight(self) -> list[_Segments]:
        """Segments of the camera's rays: the first ones, and those behind mirrors."""
        assert self.scene.camera is not None  # noqa: S101  (checked when made)
        lines: list[_Segments] = []
        start = np.broadcast_to(self.scene.camera.position_m, self._directions.shape)
        index, direction = np.arange(len(self._directions)), self._directions
        surfaces = self._still_scene.surfaces
        for _bounce in range(self.scene.mirror_bounces + 1):
            far = start + _FAR_M * direction
            hits = np.stack([each.shape.hit(start, far) for each in surfaces])
            for k, each in enumerate(surfaces):
                if each.kind == "stencil":
                    hits[k] = np.inf  # rays pass its open cells; what it hides stays hidden
            nearest = hits.min(axis=0)
            end = start + np.minimum(nearest, 1.0)[:, None] * _FAR_M * direction
            if not lines:
                self._reach_m = np.minimum(nearest, 1.0) * _FAR_M
            lines.append(_Segments(index, start, end))
            which = np.where(np.isfinite(nearest), hits.argmin(axis=0), -1)
            on = np.array([each.kind == "mirror" for each in surfaces] + [False])[which]
            if not on.any():
                break
            index, start, direction, which = index[on], end[on], direction[on].copy(), which[on]
            for k in np.unique(which):
                mine = which == k
                direction[mine] = surfaces[k].mirror.mirrored_direction(direction[mine])
        return lines

    def _step_s(self, directions: Points, width: int) -> float:
        """Longest time in which nothing moves by more than ``_PIXELS``."""
        assert self.scene.camera is not None  # noqa: S101  (checked when made)
        eye = self.scene.camera.position_m
        pixel_rad = float(
            np.arccos(np.clip(directions[width // 2] @ directions[width // 2 - 1], -1, 1))
        )
        steps_s = []
        for index in self._movers:
            surface = self.scene.surfaces[index]
            speed_m_s = sum(motion.speed_m_s for motion in surface.motions)
            reach_m = np.linalg.norm(surface.shape.extent() - eye, axis=-1).min()
            if speed_m_s:
                steps_s.append(_PIXELS * pixel_rad * max(reach_m, 1e-3) / speed_m_s)
        return float(min(steps_s, default=1.0))


class MovingResponses:
    """Impulse responses at one time: of what stands still and is visible, and of what moves."""

    def __init__(
        self,
        of: MovingLight,
        scene: Scene,
        front: NDArray[np.intp],
        in_front: Lit,
        shadows: tuple[NDArray[np.intp], ...],
    ) -> None:
        self._of = of
        self._scene = scene
        self._front = front
        self._in_front = in_front
        self._shadows = shadows
        self._shape = (of._height, of._width)  # noqa: SLF001
        self._all: SparseResponses | None = None

    @property
    def kind(self) -> Literal["sparse", "dense"]:
        """Dense where a surface spreads light."""
        return self._whole.kind

    def moments(self, frequency_hz: float) -> NDArray[np.complex128]:
        """Sum of the phasors that are not in shadow."""
        each, total = self._of.phasors(frequency_hz)
        moments = total.copy()
        for chain, dark in zip(each, self._shadows, strict=True):
            moments[dark] -= chain[dark]
        scatter = self._in_front.scatter(self._scene)
        moments[self._front] = self._in_front.moments(frequency_hz, scatter)
        return moments.reshape(self._shape)

    def returns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the returns of all pixels."""
        return self._whole.returns()

    def of_pixel(self, x: int, y: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Response of one pixel."""
        return self._whole.of_pixel(x, y)

    @property
    def scene(self) -> Scene:
        """The scene at this time."""
        return self._scene

    @property
    def lit(self) -> Lit:
        """Light of the camera's rays at this time."""
        still, front = self._of.still, self._front
        surface, distance_m = still.surface.copy(), still.distance_m.copy()
        point, reflectance = still.point.copy(), still.reflectance.copy()
        delay_s, weight = still.delay_s.copy(), still.weight.copy()
        for chain, dark in enumerate(self._shadows):
            weight[chain, dark] = 0
        surface[front], distance_m[front] = self._in_front.surface, self._in_front.distance_m
        point[front], reflectance[front] = self._in_front.point, self._in_front.reflectance
        delay_s[:, front], weight[:, front] = self._in_front.delay_s, self._in_front.weight
        return Lit(surface, point, distance_m, reflectance, delay_s, weight)

    @property
    def distance_m(self) -> NDArray[np.float64]:
        """(H, W) length of the camera's rays."""
        distance_m = self._of.still.distance_m.copy()
        distance_m[self._front] = self._in_front.distance_m
        return distance_m.reshape(self._shape)

    @property
    def reflectance(self) -> NDArray[np.float64]:
        """(H, W) of what the camera's rays end on."""
        reflectance = self._of.still.reflectance.copy()
        reflectance[self._front] = self._in_front.reflectance
        return reflectance.reshape(self._shape)

    @property
    def _whole(self) -> SparseResponses:
        if self._all is None:
            height, width = self._shape
            self._all = sparse_of(self._scene, self.lit, width=width, height=height)
        return self._all
