"""Moments of pixels by many rays: 16 in each, hundreds or thousands in those whose rays differ.

Nothing here is taken from how the simulation finds edges. A pixel is followed more finely where
its own rays or its corners end on different surfaces, get light by different ways, or differ in
brightness: a straight edge cannot cross a pixel between its corners. Light over several surfaces
is followed over 60 bounces.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._graded import graded
from transientcam_simulation.light._paths import Lit, light_rays
from transientcam_simulation.light._radiosity import Interreflection
from transientcam_simulation.light._rays import rays_through
from transientcam_simulation.scene import Scene

COARSE = 16  # rays
FINE_MOVING, FINE_STILL = 256, 4096
_ROOM = 1 << 19  # rays at a time
BOUNCES = 60
_CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)])
_UNEVEN_ABOVE = 0.1  # standard deviation of a pixel's rays over their mean

Moments = NDArray[np.complex128]
Pixels = NDArray[np.intp]
Places = NDArray[np.float64]


def reference_moments(
    scene: Scene,
    pixel: Pixels,
    size: tuple[int, int],
    frequencies_hz: tuple[float, ...],
    *,
    fine: int,
) -> Moments:
    """Return mean moments (F, P) over the rays of some pixels, by index, of a scene at a time."""
    further = _followed_further(scene)
    coarse = _rays(scene, pixel, size, _hammersley(COARSE))
    moments = _means(scene, further, coarse, len(pixel), frequencies_hz)
    corners = _rays(scene, pixel, size, _CORNERS)
    edge = np.flatnonzero(_differ(coarse, corners, len(pixel)))
    for first in range(0, edge.size, _ROOM // fine):
        some = edge[first : first + _ROOM // fine]
        many = _rays(scene, pixel[some], size, _hammersley(fine))
        moments[:, some] = _means(scene, further, many, len(some), frequencies_hz)
    return moments


def _followed_further(scene: Scene) -> tuple[Scene, Exchange] | None:
    """Return the scene with so many bounces, and the light that its surfaces exchange, if any."""
    if scene.transport.diffuse_bounces == 0 or sum(each.scatters for each in scene.surfaces) < 2:
        return None
    every = replace(scene, transport=replace(scene.transport, diffuse_bounces=BOUNCES))
    return every, graded(every, every.transport.patches)


def _rays(scene: Scene, pixel: Pixels, size: tuple[int, int], places: Places) -> Lit:
    """Follow rays through places in pixels, from their centres: for each place, all pixels."""
    assert scene.camera is not None
    width, height = size
    rows, columns = np.divmod(pixel, width)
    x, y = (columns + places[:, :1]).ravel(), (rows + places[:, 1:]).ravel()
    return light_rays(scene, rays_through(scene.camera, x, y, width=width, height=height))


def _hammersley(count: int) -> Places:
    """Evenly spread places in a pixel, a power of two of them, no two in one row or column."""
    bits = count.bit_length() - 1
    reversed_bits = [int(f"{k:0{bits}b}"[::-1], 2) for k in range(count)]
    places: Places = (np.stack([np.arange(count), reversed_bits], axis=1) + 0.5) / count - 0.5
    return places


def _means(
    scene: Scene,
    further: tuple[Scene, Exchange] | None,
    lit: Lit,
    pixels: int,
    frequencies_hz: tuple[float, ...],
) -> Moments:
    scatter = lit.scatter(scene)
    of_rays = [lit.moments(frequency_hz, scatter) for frequency_hz in frequencies_hz]
    if further is not None:
        every, exchange = further
        width = len(lit.surface)
        light = Interreflection(every, lit, width=width, height=1, exchange=exchange)
        for moments, frequency_hz in zip(of_rays, frequencies_hz, strict=True):
            moments += light.moments(frequency_hz).ravel()
    means: Moments = np.array(of_rays).reshape(len(of_rays), -1, pixels).mean(axis=1)
    return means


def _differ(one: Lit, other: Lit, pixels: int) -> NDArray[np.bool_]:
    """Pixels whose rays differ."""
    surface = np.concatenate([one.surface, other.surface]).reshape(-1, pixels)
    weight = np.concatenate([one.weight, other.weight], axis=1)
    ways = (weight > 0).reshape(len(weight), -1, pixels)
    brightness = weight.sum(axis=0).reshape(-1, pixels)
    several = (surface != surface[0]).any(axis=0) | (ways != ways[:, :1]).any(axis=(0, 1))
    uneven = brightness.std(axis=0) > _UNEVEN_ABOVE * brightness.mean(axis=0)
    differ: NDArray[np.bool_] = several | uneven
    return differ
