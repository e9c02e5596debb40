"""What the pixels see of a scene's geometry, whether light falls on it or not."""

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import SurfaceSeen
from transientcam_simulation.light._followed import Within
from transientcam_simulation.light._paths import Lit, first_hit
from transientcam_simulation.scene import Points, Scene


def surface_seen(
    scene: Scene,
    directions: Points,
    lit: Lit,
    fine: tuple[Within, ...],
    brightness: NDArray[np.floating],
) -> SurfaceSeen:
    """Return the first surface of each pixel, and the direct light's share.

    Of a scene at one moment: ``directions`` (H W, 3) go through the pixels' centres, ``lit`` and
    ``fine`` are the light of these and further rays, ``brightness`` (H, W) is all light.
    """
    assert scene.camera is not None  # noqa: S101  (a scene of surfaces has one)
    eye = scene.camera.position_m
    met = first_hit(scene, np.broadcast_to(eye, directions.shape), directions)
    which, point = met.surface, met.point
    facing = np.einsum("pc,pc->p", met.normal, directions) < 0
    seen = facing & np.array([each.opaque is None for each in scene.surfaces] + [False])[which]
    from_lamp_m = np.linalg.norm(point - scene.light.position_m, axis=-1)
    # a ray that a mirror turns ends on another surface than the one it meets first
    direct = np.where(lit.surface == which, lit.weight[0], 0.0)
    for each in fine:
        mine = each.of_pixels(each.rays.surface) == which[each.pixel]
        weight = each.of_pixels(each.rays.weight[0])
        direct[each.pixel] = np.where(mine, weight, 0.0).mean(axis=0)
    light = brightness.ravel()
    share = np.divide(direct, light, out=np.zeros_like(direct), where=(light > 0) & seen)
    range_m = np.where(seen, (met.length_m + from_lamp_m) / 2, np.nan)
    shape = brightness.shape
    return SurfaceSeen(range_m.reshape(shape), np.minimum(share, 1.0).reshape(shape))
