"""Moments of pixels by many rays: 16 in each, 256 in those where the 16 differ.

Nothing here is taken from how the simulation finds edges: a pixel is followed more finely where
its own rays end on different surfaces, get light by different ways, or differ by their moments.
"""

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.simulation.light.paths import Lit, light_rays
from transientcam_driver.simulation.light.rays import rays_through
from transientcam_driver.simulation.scene.scene import Scene

COARSE, FINE = 16, 256
_CORNERS = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]
_DIFFERS_ABOVE = 0.1  # standard deviation of a pixel's rays over their mean

Moments = NDArray[np.complex128]


def fine_moments(
    scene: Scene,
    pixel: NDArray[np.intp],
    size: tuple[int, int],
    frequencies_hz: tuple[float, ...],
) -> Moments:
    """Return mean moments (F, P) over the rays of each of some pixels, by index, at a time."""
    lit = rays_at(scene, pixel, size, _hammersley(COARSE))
    moments = _means(scene, lit, frequencies_hz)
    # a straight edge cannot cross a pixel between its corners
    edge = np.flatnonzero(_differ([*lit, *rays_at(scene, pixel, size, _CORNERS)]))
    if edge.size:
        fine = rays_at(scene, pixel[edge], size, _hammersley(FINE))
        moments[:, edge] = _means(scene, fine, frequencies_hz)
    mean: Moments = moments
    return mean


def rays_at(
    scene: Scene,
    pixel: NDArray[np.intp],
    size: tuple[int, int],
    places: list[tuple[float, float]],
) -> list[Lit]:
    """Follow rays through places in some pixels, from their centres; one entry for each place."""
    assert scene.camera is not None
    width, height = size
    rows, columns = np.divmod(pixel, width)
    return [
        light_rays(
            scene, rays_through(scene.camera, columns + x, rows + y, width=width, height=height)
        )
        for x, y in places
    ]


def _hammersley(count: int) -> list[tuple[float, float]]:
    """Evenly spread places in a pixel, a power of two of them, no two in one row or column."""
    bits = count.bit_length() - 1
    reversed_bits = [int(f"{k:0{bits}b}"[::-1], 2) for k in range(count)]
    return [
        ((k + 0.5) / count - 0.5, (other + 0.5) / count - 0.5)
        for k, other in enumerate(reversed_bits)
    ]


def _means(scene: Scene, lits: list[Lit], frequencies_hz: tuple[float, ...]) -> Moments:
    return np.array(
        [
            np.mean([lit.moments(frequency_hz, lit.scatter(scene)) for lit in lits], axis=0)
            for frequency_hz in frequencies_hz
        ]
    )


def _differ(lits: list[Lit]) -> NDArray[np.bool_]:
    """Pixels whose rays differ."""
    surfaces = np.array([lit.surface for lit in lits])
    ways = np.array([lit.weight > 0 for lit in lits])
    differ = (surfaces != surfaces[0]).any(axis=0) | (ways != ways[0]).any(axis=(0, 1))
    brightness = np.array([lit.weight.sum(axis=0) for lit in lits])
    uneven: NDArray[np.bool_] = brightness.std(axis=0) > _DIFFERS_ABOVE * brightness.mean(axis=0)
    return differ | uneven
