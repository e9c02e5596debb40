"""Moments of pixels by paths of light: mirror, gloss, scattering and entering light in any order.

It judges the simulation, and so shares nothing with it but the reading of a scene's file: hits,
shadows, reflections, lobes, motions and the lens are stated here anew. A path starts at a random
place in its pixel, is sent on at random by each surface that it meets, and takes the lamp's light
at each of them, straight and over every chain of mirrors. A pane turns it, lets it go on or is dust
by chance. Random numbers are Sobol's, shifted anew in each of several repetitions, whose spread is
the standard error.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from transientcam_simulation.scene import Ellipsoid, Mesh, Rectangle, Scene

LIGHT_M_S = 299_792_458.0
REPETITIONS = 8
_CLEAR_M = 1e-7  # from where a ray starts, nothing nearer is met
_DIMENSIONS = 20  # of Sobol's numbers; later ones are plain random
_AT_PANES = 16  # first of two after the pixel's, for the panes that a path meets at once
_MOST_MIRRORS = 16
_MOST_SCATTERINGS = 64
_ROULETTE_AFTER = 2  # scatterings, from which on weak paths end at random
_AT_A_TIME = 1 << 17  # paths

Values = NDArray[np.float64]
Points = NDArray[np.float64]  # (P, 3)
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class _Part:
    """One surface at one moment; ``sides`` are a plate's unit vectors along width and height."""

    kind: str
    centre: Points
    size: Points
    share: float
    gloss: float
    exponent: float
    spread_s: tuple[float, float]
    normal: Points | None = None
    sides: tuple[Points, Points] | None = None
    opaque: Mask | None = None
    pane: tuple[float, float, float | None] | None = None

    def splits(self, way: Points) -> tuple[Values, Values, Values]:
        """Of a pane: shares of light that are mirrored and pass, and what the glass adds to it.

        Amplitudes by Fresnel's sine and tangent laws; one face after the other, without phases.
        """
        assert self.pane is not None
        assert self.normal is not None
        index, thick, given = self.pane
        angle = np.arccos(np.abs(way @ self.normal).clip(1e-6, 1 - 1e-9))
        inside = np.arcsin(np.sin(angle) / index)
        s = (np.sin(angle - inside) / np.sin(angle + inside)) ** 2
        p = (np.tan(angle - inside) / np.tan(angle + inside)) ** 2
        both = s + (1 - s) ** 2 * s / (1 - s * s) + p + (1 - p) ** 2 * p / (1 - p * p)
        mirrored: Values = both / 2
        if given is not None:
            mirrored = np.full(len(way), given)
        clean, later = 1 - self.share, thick * (index * np.cos(inside) - np.cos(angle))
        return clean * mirrored, clean * (1 - mirrored), later

    def hit(self, start: Points, way: Points) -> Values:
        """Length along unit vectors to the surface; infinite where it is not met."""
        off = start - self.centre
        if self.normal is None or self.sides is None:
            scaled, towards = off / self.size, way / self.size
            a, b = (towards**2).sum(1), (towards * scaled).sum(1)
            root = np.sqrt(np.maximum(b * b - a * ((scaled**2).sum(1) - 1), 0))
            near, far = (-b - root) / a, (-b + root) / a
            length = np.where(near > _CLEAR_M, near, far)
            return np.where((root > 0) & (length > _CLEAR_M), length, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            length = -(off @ self.normal) / (way @ self.normal)
            right, up = (off @ side + length * (way @ side) for side in self.sides)
            met = (np.abs(right) <= self.size[0] / 2) & (np.abs(up) <= self.size[1] / 2)
        met &= length > _CLEAR_M
        if self.opaque is not None:
            rows, columns = self.opaque.shape
            column = np.floor((right[met] / self.size[0] + 0.5) * columns).astype(int)
            row = np.floor((0.5 - up[met] / self.size[1]) * rows).astype(int)
            met[met] = self.opaque[row.clip(0, rows - 1), column.clip(0, columns - 1)]
        return np.where(met, length, np.inf)

    def normals(self, points: Points) -> Points:
        """Out of the front, or out of the ball."""
        if self.normal is not None:
            return np.broadcast_to(self.normal, points.shape)
        return _unit((points - self.centre) / self.size**2)


class Tracer:
    """A scene at one moment, before a camera of so many pixels.

    Parameters
    ----------
    scene, time_s
        What the file states, and when.
    as_stated
        Follow light over no more mirrors and scatterings than the file's [transport] allows.
    """

    def __init__(
        self, scene: Scene, size: tuple[int, int], *, time_s: float = 0.0, as_stated: bool = True
    ) -> None:
        assert scene.camera is not None
        self._camera, self._size = scene.camera, size
        tables = [k for k, each in enumerate(scene.surfaces) if each.kind != "dust"]
        self._parts = [_part(scene, index, time_s) for index in tables]
        self._lamp = scene.light.position_m
        self._axis = _unit(scene.light.aim_at_m - self._lamp)
        self._beam = scene.light.beam_exponent
        most, transport = scene.transport.diffuse_bounces, scene.transport
        self._mirrors = transport.mirror_bounces if as_stated else _MOST_MIRRORS
        self._scatterings = _MOST_SCATTERINGS if most is None or not as_stated else most
        self._chains = list(self._image_lamps(min(self._mirrors, 8)))
        kinds = [each.kind for each in self._parts]
        # the last entry is of no surface, -1
        self._mirror = np.array([*(kind in ("mirror", "glass") for kind in kinds), False])
        self._panes = [each for each in self._parts if each.pane]
        self._pane = np.array([*(kind == "glass" for kind in kinds), False])
        self._scatters = np.array([*(kind in ("diffuse", "translucent") for kind in kinds), False])
        # what is dust of a pane, or mirrors there, does it by chance, and then wholly
        self._share = np.array([*(1.0 if each.pane else each.share for each in self._parts), 0.0])
        self._gloss = np.array([*(each.gloss for each in self._parts), 0.0])
        self._exponent = np.array([*(each.exponent for each in self._parts), 0.0])
        self._enters = any(any(each.spread_s) for each in self._parts)

    def moments(
        self, pixel: NDArray[np.intp], frequencies_hz: Values, *, paths: int, seed: int = 0
    ) -> NDArray[np.complex128]:
        """``int g(tau) exp(2 pi i f tau) dtau`` of pixels, by index: (REPETITIONS, F, P).

        ``paths``, a power of two, are those of one pixel and repetition.
        """
        numbers = qmc.Sobol(_DIMENSIONS, scramble=True, rng=seed).random(paths)
        found = np.zeros((REPETITIONS, len(frequencies_hz), len(pixel)), dtype=np.complex128)
        some = max(1, _AT_A_TIME // (paths * REPETITIONS))
        for first in range(0, len(pixel), some):
            of = pixel[first : first + some]
            # the same numbers for the same pixel at any time: what stands still cancels
            shifts = np.stack(
                [np.random.default_rng((seed, k)).random((REPETITIONS, _DIMENSIONS)) for k in of]
            )
            each = (shifts[:, :, None] + numbers) % 1.0
            random = np.random.default_rng((seed, int(of[0]), 1))
            light = self._followed(of, each.reshape(-1, _DIMENSIONS), frequencies_hz, random)
            by_slot = light.reshape(len(frequencies_hz), len(of), REPETITIONS) / paths
            found[:, :, first : first + some] = np.moveaxis(by_slot, 2, 0)
        return found

    def _followed(
        self,
        pixel: NDArray[np.intp],
        numbers: Values,
        frequencies_hz: Values,
        random: np.random.Generator,
    ) -> NDArray[np.complex128]:
        """Add up (F, slots) what paths bring, a slot for each pixel and repetition."""
        count, slots = len(numbers), len(pixel) * REPETITIONS
        slot = np.repeat(np.arange(slots), count // slots)
        total = np.zeros((len(frequencies_hz), slots), dtype=np.complex128)
        start, way = self._rays(np.repeat(pixel, count // len(pixel)), numbers[:, :2])
        numbers = numbers[:, 2:]
        length, weight = np.zeros(count), np.ones(count)
        late = np.ones((count, len(frequencies_hz) if self._enters else 0), dtype=np.complex128)
        scatterings, mirrors = np.zeros(count, int), np.zeros(count, int)
        alive, leg = np.arange(count), -1
        while alive.size:
            leg += 1
            at, which = self.first_hit(start, way)
            point = start + np.where(which < 0, 0.0, at)[:, None] * way
            normal = self._normals(point, which)
            front = np.einsum("pc,pc->p", normal, way) < 0
            length = length + at
            # -- a pane has two fronts, and is a mirror, white dust, or nothing, by chance
            pane = self._pane[which]
            normal[pane & ~front] *= -1
            front |= pane
            dust, passes = np.zeros((2, len(alive)), dtype=bool)
            own = numbers[alive, _AT_PANES + leg : _AT_PANES + leg + 1].ravel()
            chance = own if own.size or not self._panes else random.random(len(alive))
            for index in np.flatnonzero(self._pane):
                mine, of = np.flatnonzero(which == index), self._parts[index]
                mirrored, _, later = of.splits(way[mine])
                dust[mine] = chance[mine] < of.share
                passes[mine] = chance[mine] >= of.share + mirrored
                length[mine] += np.where(passes[mine], later, 0.0)
            turned = front & self._mirror[which] & (mirrors < self._mirrors) & ~dust & ~passes
            on = (front & self._scatters[which]) | dust
            # -- what a scattering surface sends along the path, of the lamp's light
            p, n, k, back = point[on], normal[on], which[on], -way[on]
            if self._enters:
                late[on] *= self._late(k, frequencies_hz)
            for far, received, towards in self._lamp_on(p, n):
                brought = weight[on] * received * self._sent(k, n, back, towards)
                full = (length[on] + far) / LIGHT_M_S
                lit = brought > 0
                for f, frequency_hz in enumerate(frequencies_hz):
                    phasor = brought[lit] * np.exp(2j * np.pi * frequency_hz * full[lit])
                    if self._enters:
                        phasor = phasor * late[on][lit, f]
                    into = slot[alive[on][lit]]
                    total[f] += np.bincount(into, phasor.real, slots)
                    total[f] += 1j * np.bincount(into, phasor.imag, slots)
            # -- and where it goes on
            u = self._next(numbers[alive[on]], scatterings[on], random)
            sent, factor = self._scattered(k, n, back, u)
            factor[scatterings[on] >= self._scatterings] = 0
            survives = np.where(scatterings[on] < _ROULETTE_AFTER, 1.0, np.minimum(factor, 0.95))
            factor = np.where(u[:, 3] < survives, factor / np.maximum(survives, 1e-300), 0.0)
            way, weight = way.copy(), weight.copy()
            way[on], weight[on] = sent, weight[on] * factor
            scatterings[on] += 1
            mirrors[on] = 0
            mirrors[turned] += 1
            slope = np.einsum("pc,pc->p", normal, way)
            way[turned] -= 2 * slope[turned, None] * normal[turned]
            weight[turned] *= self._share[which[turned]]
            kept = (on | turned | passes) & (weight > 0)
            alive, start, way = alive[kept], point[kept], way[kept]
            length, weight, late = length[kept], weight[kept], late[kept]
            scatterings, mirrors = scatterings[kept], mirrors[kept]
        return total

    def first_hit(self, start: Points, way: Points) -> tuple[Values, NDArray[np.intp]]:
        """Length to the first surface on each ray, and its index; infinity and -1 for none."""
        nearest, which = np.full(len(way), np.inf), np.full(len(way), -1)
        for index, part in enumerate(self._parts):
            at = part.hit(start, way)
            closer = at < nearest
            nearest[closer], which[closer] = at[closer], index
        return nearest, which

    def _clear(self, start: Points, way: Points, length: Values) -> tuple[Values, Values]:
        """Share of light that comes along lengths, 0 or 1 but for panes, and what glass adds.

        The surface where the ray ends does not count.
        """
        share, more = np.ones(len(way)), np.zeros(len(way))
        for part in self._parts:
            nearer = part.hit(start, way) <= length - _CLEAR_M
            if part.pane:
                _, passes, later = part.splits(way[nearer])
                share[nearer] *= passes
                more[nearer] += later
            else:
                share[nearer] = 0
        return share, more

    def _normals(self, point: Points, which: NDArray[np.intp]) -> Points:
        normals = np.zeros_like(point)
        for index, part in enumerate(self._parts):
            normals[which == index] = part.normals(point[which == index])
        return normals

    def _rays(self, pixel: NDArray[np.intp], place: Values) -> tuple[Points, Points]:
        width, height = self._size
        row, column = np.divmod(pixel, width)
        view, half = self._camera, np.tan(np.radians(self._camera.field_of_view_deg) / 2)
        centre = view.lens.centre
        x = half * (2 * (column + place[:, 0]) / width - 1 - 2 * centre[0])
        y = half * ((height - 2 * (row + place[:, 1])) / width + 2 * centre[1])
        k1, k2, p1, p2, k3 = view.lens.distortion
        shown_x, shown_y = x, y
        for _step in range(60 if any(view.lens.distortion) else 0):
            r = x * x + y * y
            radial = r * (k1 + r * (k2 + r * k3))
            x, y = (
                shown_x - x * radial - 2 * p1 * x * y - p2 * (r + 2 * x * x),
                shown_y - y * radial - p1 * (r + 2 * y * y) - 2 * p2 * x * y,
            )
        ahead = _unit(view.look_at_m - view.position_m)
        right = _unit(np.cross(ahead, [0.0, 0.0, 1.0]))
        way = ahead + x[:, None] * right + y[:, None] * np.cross(right, ahead)
        return np.broadcast_to(view.position_m, way.shape), _unit(way)

    # -- the lamp

    def _image_lamps(self, most: int) -> Iterator[tuple[tuple[int, ...], Points]]:
        """Chains of mirrors, the last one before a surface first, and the lamp's image in each."""
        found: list[tuple[tuple[int, ...], Points]] = [((), self._lamp)]
        for _length in range(most + 1):
            yield from found
            found = [
                ((index, *chain), image - 2 * depth * part.normal)
                for chain, image in found
                for index, part in enumerate(self._parts)
                if part.kind in ("mirror", "glass") and part.normal is not None
                if chain[:1] != (index,)
                if (depth := float((image - part.centre) @ part.normal)) > 0 or part.pane
            ]

    def _lamp_on(self, point: Points, normal: Points) -> Iterator[tuple[Values, Values, Points]]:
        """Length, irradiance and direction of the lamp's light on points, chain by chain."""
        for chain, image in self._chains:
            off = image - point
            far = np.maximum(np.linalg.norm(off, axis=1), 1e-12)
            towards = off / far[:, None]
            received = np.einsum("pc,pc->p", towards, normal).clip(0) / far**2
            lit = np.flatnonzero(received)
            if chain:
                lit = lit[self._parts[chain[0]].hit(point[lit], towards[lit]) < far[lit]]
            start, way, share, left = point[lit], towards[lit], np.ones(len(lit)), far[lit]
            for index in chain:
                part = self._parts[index]
                at, mirror = part.hit(start, way), part.normal
                kept = (at < left) & ((way @ mirror < 0) | bool(part.pane))
                clear, more = self._clear(start[kept], way[kept], at[kept])
                lit, way, share, left = lit[kept], way[kept], share[kept] * clear, (left - at)[kept]
                far[lit] += more
                start = start[kept] + at[kept, None] * way
                share = share * (part.splits(way)[0] if part.pane else part.share)
                way = way - 2 * (way @ mirror)[:, None] * mirror
            clear, more = self._clear(start, way, np.linalg.norm(self._lamp - start, axis=1))
            far[lit] += more
            share = share * clear
            share = share * ((-way @ self._axis).clip(0) ** self._beam if self._beam else 1.0)
            irradiance = np.zeros(len(point))
            irradiance[lit] = received[lit] * share
            yield far, irradiance, towards

    # -- surfaces

    def _sent(self, which: NDArray[np.intp], normal: Points, one: Points, other: Points) -> Values:
        """Share of light from one direction to another, pi times the BRDF: Lambert's, Blinn's."""
        share = self._share[which].astype(float)
        if not self._gloss.any():
            return share
        cosine = np.einsum("pc,pc->p", _unit(one + other), normal).clip(0)
        power = self._exponent[which]
        lobe: Values = share + self._gloss[which] * (power + 8) / 8 * cosine**power
        return lobe

    def _scattered(
        self, which: NDArray[np.intp], normal: Points, back: Points, u: Values
    ) -> tuple[Points, Values]:
        """Random directions, and what is left of the light: by the cosine, or the gloss's lobe."""
        share, gloss, power = self._share[which], self._gloss[which], self._exponent[which]
        of_lobe = np.divide(gloss, share + gloss, out=np.zeros(len(which)), where=gloss > 0)
        lobe = u[:, 2] < of_lobe
        cosine = np.where(lobe, u[:, 0] ** (1 / (power + 1)), np.sqrt(u[:, 0]))
        axis = _around(normal, cosine, 2 * np.pi * u[:, 1])
        mirrored = 2 * np.einsum("pc,pc->p", axis, back)[:, None] * axis - back
        sent = np.where(lobe[:, None], mirrored, axis)
        slope = np.einsum("pc,pc->p", sent, normal).clip(0)
        half = _unit(sent + back)
        tilt = np.einsum("pc,pc->p", half, normal).clip(0)
        facing = np.maximum(np.einsum("pc,pc->p", half, back), 1e-12)
        density = (1 - of_lobe) * slope + of_lobe * (power + 1) / 8 * tilt**power / facing
        factor = self._sent(which, normal, back, sent) * slope / np.maximum(density, 1e-300)
        return sent, np.where(slope > 0, factor, 0.0)

    def _late(self, which: NDArray[np.intp], frequencies_hz: Values) -> NDArray[np.complex128]:
        """Transfer (P, F) of a Gaussian and an exponential that light inside surfaces waits."""
        width_s, decay_s = np.array([each.spread_s for each in self._parts]).T[:, which, None]
        omega = 2 * np.pi * frequencies_hz
        spread: NDArray[np.complex128] = np.exp(-0.5 * (omega * width_s) ** 2) / (
            1 - 1j * omega * decay_s
        )
        return spread

    def _next(
        self, numbers: Values, scatterings: NDArray[np.int_], random: np.random.Generator
    ) -> Values:
        """Four numbers for each path's next scattering."""
        found = random.random((len(numbers), 4))
        for k in np.unique(scatterings):
            mine, own = scatterings == k, numbers[:, 4 * k : 4 * k + 4]
            if own.shape[1] == found.shape[1]:
                found[mine] = own[mine]
        return found


def _part(scene: Scene, index: int, time_s: float) -> _Part:
    surface = scene.surfaces[index]
    shape, scatter = surface.shape, surface.scatter
    if isinstance(shape, Mesh):
        raise ValueError(f"surface {index} is a mesh, which is not traced here")
    centre = shape.centre
    for motion in surface.motions:
        knots = list(motion.path_m)
        knots += {"restart": [], "back": knots[-2::-1], "loop": knots[:1]}[motion.repeat]
        turn = (time_s / motion.period_s) % 1.0
        along = np.linspace(0, 1, len(knots))
        centre = centre + [np.interp(turn, along, axis) for axis in np.array(knots).T]
    stated: dict[str, Any] = {
        "kind": surface.kind,
        "centre": centre,
        "share": surface.glass.dust if surface.glass else surface.reflectivity,
        "gloss": surface.gloss,
        "pane": (g.refractive_index, g.thickness_m, g.reflectivity)
        if (g := surface.glass)
        else None,
        "exponent": surface.gloss_exponent,
        "spread_s": (0.0, 0.0) if scatter is None else (scatter.width_s, scatter.decay_s),
    }
    if isinstance(shape, Ellipsoid):
        return _Part(size=shape.radii, **stated)
    assert isinstance(shape, Rectangle)
    normal = _unit(shape.normal)
    # upright ones stand on a horizontal edge, the upper side of lying ones is at +y
    lies = abs(normal[2]) > 1 - 1e-6
    right = _unit(np.cross([0.0, 1.0, 0.0] if lies else [0.0, 0.0, 1.0], normal))
    sides, size = (right, np.cross(normal, right)), np.array([shape.width, shape.height])
    return _Part(normal=normal, sides=sides, size=size, opaque=surface.opaque, **stated)


def _unit(vectors: Points) -> Points:
    unit: Points = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
    return unit


def _around(normal: Points, cosine: Values, angle: Values) -> Points:
    """Directions at an angle to normals, turned about them."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    across = _unit(np.cross(normal, least))
    along = np.cross(normal, across)
    sine = np.sqrt(np.maximum(0, 1 - cosine**2))
    aside = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * along
    directions: Points = cosine[:, None] * normal + sine[:, None] * aside
    return directions
