"""A lens, and where a second camera stands, measured by flat walls: these are flat in ranges."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver import Lens
from transientcam_server.errors import InputError
from transientcam_server.imaging._recipe.lens import Intrinsics

_Array = NDArray[Any]
_PIXELS: Final = 32
"""Along the shorter side, by which a wall is judged; what is off by `_WALL_M` may be none."""
_WALL_M: Final = 0.01
_APART: Final = 0.1
"""Least singular value of the walls' normals that tell a place."""
_FLAT: Final = 0.05
_WHITE: Final = 0.1
"""By which part a wall may be off a plane, and its brightness off a beam."""
_EVEN: Final = 0.02
"""Power of the cosine below which nothing tells where a beam points."""


def lens_of_walls(ranges: Sequence[_Array], start: Intrinsics) -> tuple[Lens, float, _Array]:
    """Return the lens through which walls are flattest, the median deviation in m, and the walls.

    ``ranges`` (H, W) in m are each of a flat wall from another side, NaN without a return. The lens
    begins with ``start``, and keeps its light. Walls are planes (V, 3) in 1/m: plane . point = 1.

    Raises InputError if less than half of the pixels have a range.
    """
    from scipy.optimize import least_squares  # which a daemon need not load

    step = max(1, min(ranges[0].shape) // _PIXELS)
    seen = np.stack([each[::step, ::step] for each in ranges])
    if (share := np.isfinite(seen).mean()) < 0.5:
        raise InputError("--lens", "wall", f"seen by {share:.0%} of the pixels", "seen by half")

    def lens_of(found: _Array, step: int = 1) -> Lens:
        fx, fy, cx, cy, *bent = (found[:8] / [*[step] * 4, 1, 1, 1, 1]).tolist()
        return Lens(fx, fy, cx, cy, (*bent, 0.0), *start.lens.light_m)

    def off_m(found: _Array) -> _Array:
        x, y = lens_of(found, step).slopes(*seen.shape[:0:-1])
        rays = np.stack([x, y, np.ones_like(x)])
        points = rays / np.tensordot(found[8:].reshape(-1, 3), rays, 1)[:, np.newaxis]
        light = np.reshape(start.lens.light_m, (3, 1, 1))
        path_m = np.linalg.norm(points, axis=1) + np.linalg.norm(points - light, axis=1)
        off = np.nan_to_num(path_m / 2.0 - seen, nan=1.0)  # a lens without a ray there is wrong
        return np.where(np.isfinite(seen), off, 0.0).ravel()

    planes = [[0.0, 0.0, 1.0 / np.nanmedian(each)] for each in seen]
    bent = (*start.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    first = np.concatenate([[start.fx, start.fy, start.cx, start.cy, *bent], *planes])
    scale, found = np.repeat([start.fx, 1.0], [4, first.size - 4]), first
    for loss in ("soft_l1", "cauchy"):  # what is no wall counts little, then nearly nothing
        how: Any = {"x_scale": scale, "loss": loss, "f_scale": _WALL_M, "ftol": 1e-5}
        found = least_squares(off_m, found, **how).x
    return lens_of(found), float(np.median(np.abs(off_m(found)))), found[8:].reshape(-1, 3)


def second_in_first(first: _Array, second: _Array) -> _Array:
    """Return the pose (4, 4) in m of a second camera in the first, by walls (V, 3) that both see.

    Raises InputError if the walls do not stand in three directions.
    """
    from scipy.spatial.transform import Rotation  # likewise

    far_m, far2_m = (1.0 / np.linalg.norm(each, axis=1) for each in (first, second))
    normals = first * far_m[:, np.newaxis]
    if len(first) < 3 or np.linalg.svd(normals)[1][-1] < _APART:
        raise InputError("--second", "wall", "seen from too few sides", "seen from three or more")
    pose = np.eye(4)
    pose[:3, :3] = Rotation.align_vectors(first, second)[0].as_matrix()
    pose[:3, 3] = np.linalg.lstsq(normals, far_m - far2_m)[0]
    return pose


def beam_of_wall(
    range_m: _Array, brightness_dn: _Array, exposure_s: float, seen_by: Intrinsics
) -> tuple[float, ...]:
    """Return the beam of the light, as `Lens` has it, by one flat, white, matt wall.

    ``range_m`` and ``brightness_dn`` are (H, W). Where b_0 r^2 over the cosine to the wall's normal
    falls off is the beam. Raises InputError if less than half of the pixels have a range, or more
    than a tenth of these are off a plane, or are not as bright as a beam makes it.
    """
    from scipy.optimize import least_squares  # likewise

    points, light_dn = seen_by.points(range_m).reshape(3, -1), brightness_dn.ravel()
    known = np.isfinite(points).all(axis=0) & (light_dn > 0)
    if (share := known.mean()) < 0.5:
        raise InputError("--beam", "wall", f"seen by {share:.0%} of the pixels", "seen by half")
    chosen = np.flatnonzero(known)[:: max(1, int(known.sum()) // _PIXELS**2)]
    points, light_dn = points[:, chosen], light_dn[chosen]
    plane = np.linalg.lstsq(points.T, np.ones(chosen.size))[0]
    way = points - np.reshape(seen_by.lens.light_m, (3, 1))
    far_m = np.linalg.norm(way, axis=0)
    facing = np.abs(plane @ way) / (np.linalg.norm(plane) * far_m)
    white = np.log(light_dn * far_m**2 / (facing * exposure_s))

    def axis_of(found: _Array) -> _Array:
        along = np.array([*found[:2], 1.0])
        return np.asarray(along / np.linalg.norm(along))

    def off(found: _Array) -> _Array:
        cosine = np.maximum(axis_of(found) @ way / far_m, 1e-3)
        return np.asarray(found[3] + found[2] * np.log(cosine) - white)

    low = [-np.inf, -np.inf, 0.0, -np.inf]
    start = [0.0, 0.0, 1.0, np.median(white)]
    found = least_squares(off, start, bounds=(low, np.inf), loss="soft_l1", f_scale=0.05).x
    if found[2] < _EVEN:  # light that is as bright everywhere has no axis
        found[:3] = 0.0
    for what, parts, most in (
        ("off a plane", plane @ points - 1, _FLAT),
        ("brighter or darker than a beam makes it", off(found), _WHITE),
    ):
        if (share := np.mean(np.abs(parts) > most)) > 0.1:
            raise InputError("--beam", "wall", f"{what} in {share:.0%} of it", "flat and white")
    return (*axis_of(found).tolist(), float(found[2]), float(np.exp(found[3])))
