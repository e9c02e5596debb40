"""Compiled: the light on points, and moments of pixels."""

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.compiled import (
    CHUNK,
    DOUBLES,
    INDICES,
    LINE,
    NUMBERS,
    PIXELS,
    PLACES,
    REGION,
    STACK,
    TILES,
    WHOLE,
    float32,
    float64,
    inner,
    int64,
    lane,
)
from transientcam_simulation.light._bundle import Numbers
from transientcam_simulation.light._coverage import ONE, ZERO, Plane

Indices = NDArray[np.int64]
Doubles = NDArray[np.float64]
Numbers3 = tuple[np.float32, np.float32, np.float32]
Planes3 = tuple[Plane, Plane, Plane]


@inner
def _receive(
    lamp: Numbers3, axis: Numbers3, point: Planes3, normal: Planes3, put: Planes3
) -> None:  # fmt: skip
    """Put lengths of the ways to a lamp, irradiance, and cosines to its axis, of points."""
    x, y, z = point
    across, along, up = normal
    length_m, irradiance, cosine = put
    for i in range(len(x)):
        a, b, c = lamp[0] - x[i], lamp[1] - y[i], lamp[2] - z[i]
        length = np.sqrt(a * a + b * b + c * c)
        facing = a * across[i] + b * along[i] + c * up[i]
        length_m[i] = length
        irradiance[i] = max(facing, ZERO) / (length * length * length)
        cosine[i] = -(a * axis[0] + b * axis[1] + c * axis[2]) / length


@lane(LINE, LINE, LINE, LINE, LINE, LINE, LINE, LINE, PLACES)
def received(
    lamp: Plane, axis: Plane, x: Plane, y: Plane, z: Plane, across: Plane, along: Plane, up: Plane,
    on: Indices,
) -> Planes3:  # fmt: skip
    """Return lengths of the ways to a lamp, irradiance, and cosines to its axis, of some points."""
    count = len(on)
    length_m, irradiance = np.empty(count, np.float32), np.empty(count, np.float32)
    cosine = np.empty(count, np.float32)
    of = (lamp[0], lamp[1], lamp[2]), (axis[0], axis[1], axis[2])
    put = length_m, irradiance, cosine
    if count == len(x):
        _receive(*of, (x, y, z), (across, along, up), put)
    else:
        _receive(*of, (x[on], y[on], z[on]), (across[on], along[on], up[on]), put)
    return length_m, irradiance, cosine


@inner
def _darken(moments: Plane, each: Plane, light: Plane) -> None:
    """Do it for a chunk of pixels with one number, or two, each."""
    if len(moments) == len(light):
        for i in range(len(light)):
            moments[i] -= (ONE - light[i]) * each[i]
        return
    for i in range(len(light)):
        dark = ONE - light[i]
        moments[2 * i] -= dark * each[2 * i]
        moments[2 * i + 1] -= dark * each[2 * i + 1]


@inner
def _copy(values: Plane, copied: Plane) -> None:
    """Copy a row in a loop that a compiler makes vectors of, unlike an assignment to a slice."""
    for i in range(len(copied)):
        copied[i] = values[i]


@inner
def _leave(moments: Plane, rest: Plane) -> None:
    """Leave a share of the moments in a row of pixels."""
    if len(moments) == len(rest):
        for c in range(len(rest)):
            moments[c] *= rest[c]
        return
    for c in range(len(rest)):
        moments[2 * c] *= rest[c]
        moments[2 * c + 1] *= rest[c]


@lane(WHOLE, STACK, PLACES, NUMBERS, STACK, TILES, WHOLE, REGION)
def remaining(
    total: Plane, each: Plane, chains: Indices, regions: Indices, light: Plane,
    marks: NDArray[np.bool_], uncovered: Plane, of: Numbers,
) -> Plane:  # fmt: skip
    """Return moments of a region, without what shadows take of each chain's, and what is covered.

    A moment is a real number, or a real and an imaginary one. See `layers` for the shadows.
    """
    top, start, height, width = of
    parts = total.shape[1] // uncovered.shape[1]
    moments = np.empty((height, parts * width), np.float32)
    for row in range(height):
        r, line = top + row, moments[row]
        _copy(total[r, parts * start : parts * (start + width)], line)
        for k in range(len(chains)):
            first, after = regions[k, 1], regions[k, 1] + regions[k, 3]
            for c in range((regions[k, 3] + CHUNK - 1) // CHUNK):
                if marks[k, r, c]:
                    a, b = first + c * CHUNK, min(first + (c + 1) * CHUNK, after)
                    _darken(
                        line[parts * (a - start) : parts * (b - start)],
                        each[chains[k], r, parts * a : parts * b],
                        light[k, r, a:b],
                    )
        _leave(line, uncovered[r, start : start + width])
    return moments


@lane(DOUBLES, float64)
def phases(delay_s: Doubles, angular_hz: float) -> Plane:
    """Return phases of light with some times of flight."""
    phase_rad = np.empty(len(delay_s), np.float32)
    for i in range(len(delay_s)):
        phase_rad[i] = angular_hz * delay_s[i]
    return phase_rad


@lane(WHOLE, PLACES, DOUBLES, LINE, LINE)
def turned(
    of_rays: Plane, on: Indices, weight: Doubles, cosine: Plane, sine: Plane
) -> None:  # fmt: skip
    """Add phasors to moments of some points, real and imaginary parts in turn."""
    if len(on) == len(of_rays):
        for i in range(len(of_rays)):
            of_rays[i, 0] = of_rays[i, 0] + weight[i] * cosine[i]
            of_rays[i, 1] = of_rays[i, 1] + weight[i] * sine[i]
        return
    for k in range(len(on)):
        i = on[k]
        of_rays[i, 0] = of_rays[i, 0] + weight[k] * cosine[k]
        of_rays[i, 1] = of_rays[i, 1] + weight[k] * sine[k]


@inner
def _upright(
    x: Plane, y: Plane, z: Plane, ball: tuple[np.float32, ...], normal: Planes3
) -> None:  # fmt: skip
    """Put unit normals of one ellipsoid."""
    across, along, up = normal
    for i in range(len(x)):
        a, b, c = (x[i] - ball[0]) / ball[3], (y[i] - ball[1]) / ball[4], (z[i] - ball[2]) / ball[5]
        length = np.sqrt(a * a + b * b + c * c)
        across[i], along[i], up[i] = a / length, b / length, c / length


@lane(LINE, LINE, LINE, WHOLE, NUMBERS)
def upright(x: Plane, y: Plane, z: Plane, balls: Plane, spans: Indices) -> Plane:
    """Return unit normals (3, P) at points on ellipsoids, each with a span (N, 2) of the points.

    ``balls`` (N, 6) are their centres and squared radii.
    """
    normal = np.empty((3, len(x)), np.float32)
    for n in range(len(balls)):
        ball = balls[n, 0], balls[n, 1], balls[n, 2], balls[n, 3], balls[n, 4], balls[n, 5]
        a, b = spans[n, 0], spans[n, 1]
        _upright(
            x[a:b], y[a:b], z[a:b], ball, (normal[0, a:b], normal[1, a:b], normal[2, a:b])
        )  # fmt: skip
    return normal


@lane(LINE, LINE, LINE, LINE, LINE, LINE, DOUBLES, DOUBLES, INDICES)
def returned(
    across: Plane, along: Plane, up: Plane, x: Plane, y: Plane, z: Plane, throughput: Doubles,
    albedos: Doubles, index: NDArray[np.int32],
) -> tuple[Doubles, Doubles]:  # fmt: skip
    """Return throughput and reflectance of points that are seen from in front, of others 0."""
    facing, reflectance = np.empty(len(x), np.float64), np.empty(len(x), np.float64)
    for i in range(len(x)):
        towards = ZERO + across[i] * x[i] + along[i] * y[i] + up[i] * z[i]
        facing[i] = throughput[i] if towards < ZERO else 0.0
    for i in range(len(x)):
        reflectance[i] = albedos[index[i]] * facing[i]
    return facing, reflectance


@lane(LINE, LINE, LINE, PLACES, DOUBLES, float64)
def arrived(
    length_m: Plane, distance_m: Plane, irradiance: Plane, on: Indices, sent: Doubles,
    metres_per_s: float,
) -> tuple[Doubles, Doubles]:  # fmt: skip
    """Return times of flight and weights of the light on some points."""
    count = len(on)
    delay_s, weight = np.empty(count, np.float64), np.empty(count, np.float64)
    if count == len(sent):
        for i in range(count):
            delay_s[i] = (np.float64(length_m[i]) + np.float64(distance_m[i])) / metres_per_s
            weight[i] = sent[i] * np.float64(irradiance[i])
        return delay_s, weight
    for k in range(count):
        i = on[k]
        delay_s[k] = (np.float64(length_m[k]) + np.float64(distance_m[i])) / metres_per_s
        weight[k] = sent[i] * np.float64(irradiance[k])
    return delay_s, weight


@lane(WHOLE, PIXELS, WHOLE, LINE, int64, int64)
def layered(
    moments: Plane, places: NDArray[np.int32], of_rays: Plane, share: Plane, top: int, left: int
) -> None:
    """Add moments of what covers pixels, by its share."""
    rows, columns = places[0], places[1]
    if of_rays.shape[1] == 1:
        for k in range(len(rows)):
            moments[rows[k] - top, columns[k] - left] += of_rays[k, 0] * share[k]
        return
    for k in range(len(rows)):
        row, column = rows[k] - top, 2 * (columns[k] - left)
        moments[row, column] += of_rays[k, 0] * share[k]
        moments[row, column + 1] += of_rays[k, 1] * share[k]


@lane(WHOLE, PIXELS, LINE)
def uncover(uncovered: Plane, places: NDArray[np.int32], share: Plane) -> None:
    """Take from pixels what layers cover of them, one after the other; at most all is covered."""
    rows, columns = places[0], places[1]
    for k in range(len(rows)):
        uncovered[rows[k], columns[k]] -= share[k]
    for k in range(len(rows)):
        left = uncovered[rows[k], columns[k]]
        uncovered[rows[k], columns[k]] = max(left, ZERO)


@lane(WHOLE, int64, REGION, float32, WHOLE, REGION, float32, WHOLE, REGION)
def blended(
    total: Plane, parts: int, of: Numbers, one: np.float32, first: Plane, of_first: Numbers,
    other: np.float32, second: Plane, of_second: Numbers,
) -> Plane:  # fmt: skip
    """Return moments of a region between two times, from those of the regions that differ then.

    A moment has so many parts.
    """
    top, left, height, width = of
    mixed = np.empty((height, parts * width), np.float32)
    then, later = np.empty(parts * width, np.float32), np.empty(parts * width, np.float32)
    for row in range(height):
        r = top + row
        still = total[r, parts * left : parts * (left + width)]
        _copy(still, then)
        _copy(still, later)
        place = r - of_first[0]
        if 0 <= place < of_first[2]:
            shift = parts * (of_first[1] - left)
            _copy(first[place], then[shift : shift + parts * of_first[3]])
        place = r - of_second[0]
        if 0 <= place < of_second[2]:
            shift = parts * (of_second[1] - left)
            _copy(second[place], later[shift : shift + parts * of_second[3]])
        line = mixed[row]
        for c in range(len(line)):
            line[c] = one * then[c] + other * later[c]
    return mixed
