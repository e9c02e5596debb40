"""Averaging over neighbours: what stays, what is averaged, and what is said of its noise."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm

Array = NDArray[Any]
RAD_PER_M = 4 * np.pi * 23e6 / 299792458.0
STD = 0.01


def wall(range_m: Array, seed: int | None = 0, m: int = 4) -> Array:
    """Moments of one return of brightness 1 a pixel, with the noise of `noise`."""
    b: Array = np.exp(1j * np.arange(m + 1)[:, None, None] * RAD_PER_M * range_m)
    if seed is not None:
        rng = np.random.default_rng(seed)
        b = b + STD * (rng.normal(size=b.shape) + 1j * rng.normal(size=b.shape))
    b[0] = b[0].real
    return b


def noise(b: Array, std: float = STD) -> tm.noise.MomentNoise:
    return tm.noise.MomentNoise(np.full(b.shape, std**2))


def averaged(b: Array, **how: Any) -> tm.Averaged:
    return tm.average_neighbours(b, noise(b), **how)


def range_m(b: Array) -> Array:
    """Range by all moments, weighted as their phases are known, from where b_1 has it."""
    j = np.arange(1, len(b))[:, None, None]
    start = np.angle(b[1])
    off = np.angle(b[1:] * np.exp(-1j * j * start))
    found: Array = (start + (j * off).sum(0) / (j**2).sum()) / RAD_PER_M
    return found


def ridges(height_m: float, slant: float = 0.0) -> tuple[Array, Array]:
    """A wall at 2 m with ridges 1 px wide, 8 px apart, and where they are."""
    rows, columns = np.mgrid[:56, :72]
    there = (columns + np.floor(slant * rows)) % 8 == 3
    return 2 - height_m * there, there


def contrast(height_m: float, smoothed: Callable[[Array], Array], slant: float = 0.0) -> float:
    surface, there = ridges(height_m, slant)
    found = range_m(smoothed(wall(surface)))
    inner = np.zeros_like(there)
    inner[8:-8, 8:-8] = True
    between = np.median(found[inner & ~there]) - np.median(found[inner & there])
    return float(between / height_m)


def brute_force(b: Array, variance: Array, left_out: Array) -> tuple[Array, Array]:
    """The definition, pixel by pixel and neighbour by neighbour."""
    planes, height, width = b.shape
    pixels = list(itertools.product(range(height), range(width)))
    there = {p: bool(np.isfinite(b[:, *p]).all()) and not left_out[p] for p in pixels}
    j, numbers = np.arange(planes), 2 * planes - 1
    raw = {p: b[:, *p] if there[p] else np.zeros(planes, complex) for p in pixels}
    estimate, worth = dict(raw), dict.fromkeys(pixels, 1.0)
    for radius in (1.5, 2.2, 4.5):
        found = {}
        for p in pixels:
            weights, values = [], []
            tangent = 1j * j * estimate[p]
            information = (abs(tangent) ** 2 / variance[:, *p]).sum()
            for q in pixels:
                row, column = q[0] - p[0], q[1] - p[1]
                place = 1 - (row**2 + column**2) / (radius + 0.5) ** 2
                if place <= 0 or not there[q] or max(abs(row), abs(column)) > 4:
                    continue
                alone = [estimate[p] - estimate[q]]
                other = (p[0] - row, p[1] - column)
                if there.get(other):  # both get one weight
                    alone.append(estimate[p] - estimate[other])
                misfit = shift = 0.0
                small = 1 / len(alone)
                tested: list[tuple[Array, float, float]] = [(np.mean(alone, axis=0), 1.0, 1.0)]
                tested += [(off, 0.02 * small, 0.001 * small) for off in alone]
                for off, part, smaller in tested:
                    misfit += part * (abs(off) ** 2 / variance[:, *p]).sum()
                    later = (tangent.conj() * off / variance[:, *p]).real.sum()
                    shift += smaller * later**2 / max(information, 1e-300)
                doubt = worth[p] * max(misfit / (4 * numbers), 2 * shift / 8)
                agreement = 1.0 if q == p else min(max(2 - doubt, 0.0), 1.0)
                weights.append(place * agreement)
                values.append(raw[q])
            if weights:
                mean = np.average(values, axis=0, weights=weights) if sum(weights) else 0 * raw[p]
                square = sum(w * w for w in weights)
                found[p] = mean, sum(weights) ** 2 / square if square else 1.0
            else:
                found[p] = 0 * raw[p], 1.0
        estimate = {p: each for p, (each, _) in found.items()}
        worth = {p: each if there[p] else 1.0 for p, (_, each) in found.items()}
    worth, estimate = joined(there, estimate, worth, variance)
    known = {p: there[p] * (j**2 * abs(estimate[p]) ** 2 / variance[:, *p]).sum() for p in pixels}
    late = {
        p: there[p]
        * (np.conj(1j * j * estimate[p]) * (raw[p] - estimate[p]) / variance[:, *p]).real.sum()
        for p in pixels
    }
    share = np.ones((height, width))
    slopes = [(1, 0), (0, 1), (1, 1), (1, -1), (1, 0.5), (1, -0.5), (0.5, 1), (-0.5, 1)]
    lines = [
        [(to(i * y), to(i * x)) for i in range(-4, 5)]
        for y, x in slopes
        for to in (math.floor, math.ceil)
    ]
    given = dict(estimate)
    for p in pixels:
        best, later, part = 0.0, 0.0, 0.0
        for line in lines:
            places = [(p[0] + y, p[1] + x) for y, x in line]
            together = sum(known.get(q, 0.0) for q in places)
            total = sum(late.get(q, 0.0) for q in places)
            if together and total**2 / together > best:
                best, later, part = total**2 / together, total / together, known[p] / together
        if there[p] and best > 12:
            given[p] = estimate[p] * (1 + 1j * j * later)
        if there[p]:
            share[p] = min(1.0, 1 / worth[p] + part * (2 if best > 12 else max(best - 5, 0)))
    moments = np.array(
        [[given[y, x] if there[y, x] else b[:, y, x] for x in range(width)] for y in range(height)]
    )
    return np.moveaxis(moments, -1, 0), share


def joined(
    there: dict[Any, bool], estimate: dict[Any, Array], worth: dict[Any, float], variance: Array
) -> tuple[dict[Any, float], dict[Any, Array]]:
    """What `brute_force` makes of pixels beside averages of more pixels, which noise explains."""
    planes = len(variance)
    j, numbers = np.arange(planes), 2 * planes - 1
    new_worth, new = dict(worth), dict(estimate)
    for p in (p for p in there if there[p]):
        candidates = []
        for row, column in ((0, 1), (1, 0), (1, 1), (1, -1)):
            sides = [(p[0] + row, p[1] + column), (p[0] - row, p[1] - column)]
            sides = [q for q in sides if there.get(q)]
            groups = [sides] if len(sides) == 2 else []
            groups += [[q] for q in sides] if worth[p] < 2 else []
            for group in groups:
                mean = sum(estimate[q] for q in group) / len(group)
                share = sum(1 / worth[q] for q in group) / len(group)
                off = estimate[p] - mean
                misfit = (abs(off) ** 2 / variance[:, *p]).sum()
                later = (np.conj(1j * j * mean) * off / variance[:, *p]).real.sum()
                information = (abs(j * mean) ** 2 / variance[:, *p]).sum()
                apart = share + 1 / worth[p]
                chance = misfit < apart * (numbers + 5 * math.sqrt(2 * numbers))
                if chance and later**2 < 25 * apart * information and share < 1 / worth[p]:
                    candidates.append((len(group) == 1, share, mean))
        if candidates:
            *_, share, new[p] = min(candidates, key=lambda each: each[:2])
            new_worth[p] = 1 / share
    return new_worth, new


@pytest.mark.parametrize(("deviations", "kept"), [(3.0, False), (8.0, True)])
def test_a_lone_pixel_is_taken_for_noise_as_long_as_noise_explains_it(
    deviations: float, kept: bool
) -> None:
    rows, columns = np.mgrid[:24, :24]
    slope = 1.5 + 0.004 * columns
    surface = slope + 0.0
    std_m = STD / math.sqrt(30) / RAD_PER_M  # of a pixel by itself: the sum of j^2 is 30
    dots = (rows % 6 == 3) & (columns % 6 == 3)
    surface[dots] += deviations * std_m
    quiet = wall(surface, seed=None) + 0.3 * (wall(slope) - wall(slope, seed=None))

    found = averaged(quiet)

    off = np.abs(range_m(found.moments) - surface)[dots]
    assert (off < 0.6 * std_m).all() == kept


def test_it_is_what_a_loop_over_pixels_and_neighbours_makes() -> None:
    rows, columns = np.mgrid[:8, :11]
    b = wall(1.5 + 0.006 * columns + 0.003 * rows + 0.05 * (columns > 6), m=2)
    b[1, 2, 3] = np.nan
    left_out = (rows == 5) & (columns == 8)
    variance = STD**2 * (1 + 0.5 * np.random.default_rng(1).random(b.shape))

    found = tm.average_neighbours(b, tm.noise.MomentNoise(variance), left_out=left_out)

    moments, share = brute_force(b, variance, left_out)
    assert np.allclose(found.moments, moments, rtol=1e-9, equal_nan=True)
    assert np.allclose(found.share, share, rtol=1e-9)
    assert np.allclose(found.noise.variance, variance * share, rtol=1e-9)


@pytest.mark.parametrize(("row", "column"), [(0.0, 0.0), (1e-4, -2e-4)])
def test_constant_and_linear_fields_stay(row: float, column: float) -> None:
    rows, columns = np.mgrid[:16, :18]
    b: Array = (1 + row * rows + column * columns) * np.exp(1j * np.arange(4))[:, None, None]

    found = averaged(b)

    inner = np.s_[:, 4:-4, 4:-4]  # at the border there is no mirror image
    assert np.allclose(found.moments[inner], b[inner], rtol=1e-12)
    assert found.share[inner[1:]].max() < 1 / 30


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_or_left_out_stays_and_is_not_spread(bad: float) -> None:
    b = wall(np.full((16, 18), 2.0))
    broken = b.copy()
    broken[2, 6, 7] = bad
    broken[:, 9, 9] = 1e9
    left_out = np.zeros((16, 18), bool)
    left_out[9, 9] = True
    others = np.ones((16, 18), bool)
    others[[6, 9], [7, 9]] = False

    found = averaged(broken, left_out=left_out)

    b[:, ~others] = 0  # whatever they held
    without = averaged(b, left_out=~others)
    assert np.array_equal(found.moments[:, others], without.moments[:, others])
    assert np.array_equal(found.moments[:, ~others], broken[:, ~others], equal_nan=True)
    assert np.array_equal(found.share[~others], [1, 1])


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
@pytest.mark.parametrize("scale", [2.0**-55, 2.0**55])
def test_the_unit_of_the_moments_does_not_matter(scale: float, dtype: type) -> None:
    b: Array = wall(np.full((9, 10), 2.0)).astype(dtype)
    std = np.full(b.shape, STD, b.real.dtype)

    found = tm.average_neighbours(b, tm.noise.MomentNoise(std**2))
    scaled = tm.average_neighbours(b * scale, tm.noise.MomentNoise((std * scale) ** 2))

    assert np.allclose(scaled.moments / scale, found.moments, rtol=1e-5)
    assert np.allclose(scaled.share, found.share, rtol=1e-4)


@pytest.mark.parametrize("turned", [np.fliplr, np.flipud, np.transpose, np.rot90])
def test_a_turned_picture_is_averaged_alike(turned: Callable[[Array], Array]) -> None:
    b = wall(2 - 0.02 * (np.mgrid[:14, :14].sum(0) % 5 == 0))

    found = averaged(np.stack([turned(plane) for plane in b]))

    assert np.allclose(found.moments, [turned(plane) for plane in averaged(b).moments])
    assert np.allclose(found.share, turned(averaged(b).share))


def test_a_plane_that_was_not_measured_decides_nothing() -> None:
    b = wall(np.full((9, 10), 2.0))
    variance = noise(b).variance.copy()
    variance[0] = 0
    other = b.copy()
    other[0] = np.arange(90).reshape(9, 10)

    found, same = (
        tm.average_neighbours(each, tm.noise.MomentNoise(variance)) for each in (b, other)
    )

    assert np.array_equal(found.moments[1:], same.moments[1:])


@pytest.mark.parametrize("slant", [0.0, 0.5, 1.0])
def test_ridges_one_pixel_wide_keep_their_contrast(slant: float) -> None:
    def smoothed(b: Array) -> Array:
        return np.asarray(averaged(b).moments)

    assert contrast(0.02, smoothed, slant) >= 0.95
    assert contrast(0.005, smoothed, slant) >= 0.6


@pytest.mark.parametrize("step_m", [0.2, 1.0])
def test_pixels_beside_a_step_do_not_take_the_other_sides_range(step_m: float) -> None:
    rows, columns = np.mgrid[:40, :48]
    surface = 1.5 + 0.004 * columns + 0.002 * rows + step_m * (columns >= 24)

    error = range_m(averaged(wall(surface)).moments) - surface

    assert np.sqrt((error[:, 23:25] ** 2).mean()) <= 0.003


def test_the_noise_left_is_the_one_stated() -> None:
    b = wall(np.full((60, 80), 2.0), seed=3)

    found = averaged(b)

    truth = wall(np.full((60, 80), 2.0), seed=None)
    z = np.abs(found.moments[1:] - truth[1:]) / np.sqrt(found.noise.variance[1:])
    assert np.median(found.share) < 1 / 40
    assert 0.8 < np.sqrt((z**2).mean() / 2) < 1.1
    off = range_m(found.moments) - 2
    beyond = np.abs(off) > 3 * STD / math.sqrt(30) / RAD_PER_M * np.sqrt(found.share)
    assert beyond.mean() < 0.004


@pytest.mark.parametrize(
    ("field", "arguments"),
    [
        ("moments", {"moments": np.ones((3, 4), complex)}),
        ("noise", {"noise": tm.noise.MomentNoise(np.ones((2, 4, 5)))}),
        ("left_out", {"left_out": np.ones((4, 4), bool)}),
        ("multiples", {"multiples": (0, 1)}),
    ],
)
def test_other_shapes_are_refused(field: str, arguments: dict[str, Any]) -> None:
    usual: dict[str, Any] = {
        "moments": np.ones((3, 4, 5), complex),
        "noise": tm.noise.MomentNoise(np.ones((3, 4, 5))),
    }

    with pytest.raises(tm.ShapeError, match=field):
        tm.average_neighbours(**(usual | arguments))


def test_pixels_count_as_often_as_they_have_frames() -> None:
    b = wall(np.full((24, 24), 2.0), seed=None)
    frames = np.ones((24, 24))
    frames[:, 12:] = 100.0
    random = np.random.default_rng(4)
    parts = STD / np.sqrt(frames) * random.normal(size=(2, *b.shape))
    own = tm.noise.MomentNoise(np.broadcast_to(STD**2 / frames, b.shape))

    found = tm.average_neighbours(b + parts[0] + 1j * parts[1], own, frames=frames)

    beside = found.noise.variance[1][4:-4, 9:12]
    assert np.mean(beside < STD**2 / 100) > 0.9, "of one frame, beside pixels with a hundred"
    z = (found.moments - b)[1:] / np.sqrt(found.noise.variance[1:])
    assert np.mean(abs(z) ** 2) / 2 < 1.5
    whole = tm.average_neighbours(b + parts[0], noise(b), frames=np.full((24, 24), 7.0))
    assert np.allclose(whole.share, averaged(b + parts[0]).share)
