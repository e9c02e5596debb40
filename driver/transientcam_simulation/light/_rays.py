"""The rays of a camera: through places in its pixels, as its lens bends them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.base import Lens
from transientcam_simulation.scene import Points, Viewpoint

_LENS_STEPS = 20
RAYS = 32
"""Into a pixel that light differs in."""
RAYS_AT_THIN = 128
"""In scenes with something thinner than two pixels, which few of a pixel's rays meet."""
RAYS_AT_EDGES = (256, 2048)
"""Into a pixel in which a ray more or less would count, and where it still does."""
MOST_RAYS = 1 << 22
"""Into all of these pixels: some ten seconds of processor time. Large images take fewer in each."""
_GOLDEN = (5**0.5 - 1) / 2


def camera_rays(view: Viewpoint, *, width: int, height: int) -> Points:
    """Return unit vectors through the pixels' centres, row by row from the top."""
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    return rays_through(view, columns.ravel(), rows.ravel(), width=width, height=height)


def rays_within(
    view: Viewpoint, pixel: NDArray[np.intp], count: int = RAYS, *, width: int, height: int
) -> Points:
    """Return unit vectors, so many each, through some pixels: for each place, all pixels.

    Places are a lattice by the golden ratio, no two in one row or column: an edge along the pixels,
    as of most things that are built, is resolved as finely as others.
    """
    rows, columns = np.divmod(pixel, width)
    right, down = places_within(count)
    through = (columns + right[:, None]).ravel(), (rows + down[:, None]).ravel()
    return rays_through(view, *through, width=width, height=height)


def places_within(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return places in a pixel, right of and below its centre."""
    place = np.arange(count, dtype=np.float64)
    return (place + 0.5) / count - 0.5, (place * _GOLDEN + 0.5 / count) % 1.0 - 0.5


def rays_through(
    view: Viewpoint, column: NDArray[Any], row: NDArray[Any], *, width: int, height: int
) -> Points:
    """Return unit vectors through places on the sensor; whole numbers are pixels' centres."""
    right, down, forward = view.axes
    half = np.tan(np.radians(view.field_of_view_deg) / 2)
    x = half * (2 * (column + 0.5) / width - 1)
    y = half * (height / width) * (1 - 2 * (row + 0.5) / height)
    if view.lens.bends:
        x, y = _straightened(
            view.lens, x - 2 * half * view.lens.centre[0], y + 2 * half * view.lens.centre[1]
        )
    rays = forward + x[:, None] * right - y[:, None] * down
    directions: Points = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return directions


def _straightened(
    lens: Lens, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where a pinhole would see what this lens shows at (x, y); y points up.

    Brown's model is inverted by fixed-point iteration, as is usual.
    """
    k1, k2, p1, p2, k3 = lens.distortion
    shown_x, shown_y = x, y
    for _step in range(_LENS_STEPS):
        squared = x * x + y * y
        radial = np.maximum(1 + squared * (k1 + squared * (k2 + squared * k3)), 0.2)
        x, y = (
            (shown_x - 2 * p1 * x * y - p2 * (squared + 2 * x * x)) / radial,
            (shown_y - p1 * (squared + 2 * y * y) - 2 * p2 * x * y) / radial,
        )
    return x, y
