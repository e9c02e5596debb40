"""Ways to average over neighbours, on moments and on ranges: errors against truth, and time."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter, uniform_filter

import transientcam_moments as tm
from benchmarks.common.tables import Table
from benchmarks.likelihood.errors import captured, errors_of, turn_m
from transientcam_driver import Sequence as Capture
from transientcam_experiments.paper.bench import Bench
from transientcam_moments.reconstruction import NEIGHBOURS

Array = NDArray[Any]
SCENES: Final = ("wall", "mirrors", "corner")
ORDER: Final = 4
SEED: Final = 1
F_HZ: Final = 23e6
ZEROTH: Final = "low-frequency"
REACH_PX: Final = 4
STEP_M: Final = 0.1
"""Of the truth within 3 x 3 pixels, from which the middle one is beside an edge."""
RIDGES_M: Final = (0.005, 0.02)
REPEATED: Final = 5
SIGNAL_DN: Final = 900.0


class Way(NamedTuple):
    """A range (H, W) in m, its stated deviation where there is one, and processor time in s."""

    range_m: Array
    std_m: Array | None
    time_s: float


def tables() -> Iterator[Table]:
    """Compare filters on the same captures of one take, and on ridges one pixel wide."""
    bench = Bench(seed=SEED)
    tm.kernels.compile(harmonics=[ORDER], precisions=("float32",))
    for scene in SCENES:
        yield _of_scene(bench, scene)
    yield _of_ridges()


def _of_scene(bench: Bench, scene: str) -> Table:
    table = Table(
        f"{scene}, one take",
        ("way", "median / 90 % / RMSE / bias, mm", "RMS beside edges, mm", "abs z, median",
         "beyond 3 deviations", "processor time, ms"),
    )  # fmt: skip
    for takes in (1, 12):
        sequence = Capture(base_frequency_hz=F_HZ, harmonics=ORDER, takes=takes, zeroth=ZEROTH)
        shot, gains, settings, truth = captured(bench, scene, sequence)
        ways = _ways(shot.found.measured, replace(settings, estimator="likelihood"), gains)
        known = np.nan_to_num(truth, nan=-10.0)  # the rim of what has a truth is an edge, too
        edge = maximum_filter(known, 3) - minimum_filter(known, 3) > STEP_M
        turn = turn_m(F_HZ)
        for name, way in ways.items():
            if takes > 1 and name != "moments: gaussian":
                continue
            off = np.remainder(way.range_m - truth + turn / 2, turn) - turn / 2
            beside = off[edge & np.isfinite(off)]
            z = np.empty(0) if way.std_m is None else np.abs(off / way.std_m)[np.isfinite(off)]
            table.rows.append((
                name if takes == 1 else f"{name}, {takes} takes",
                str(errors_of(way.range_m, truth, turn)),
                f"{1e3 * np.sqrt((beside**2).mean()):.1f}" if beside.size else "",
                f"{np.median(z):.2f}" if z.size else "",
                f"{np.mean(z > 3):.1%}" if z.size else "",
                f"{1e3 * way.time_s:.1f}",
            ))  # fmt: skip
    return table


def _of_ridges() -> Table:
    table = Table(
        "Contrast that is left of ridges one pixel wide on a wall",
        ("way", *(f"{1e3 * h:.0f} mm, {way}" for h in RIDGES_M for way in ("upright", "1:2"))),
    )
    sensor = tm.noise.Sensor()
    settings = tm.Settings(F_HZ, ZEROTH, takes=1, estimator="likelihood", sensor=sensor)
    rows, columns = np.mgrid[:56, :72]
    inner = (slice(8, -8), slice(8, -8))
    found: dict[str, list[float]] = {}
    for height_m in RIDGES_M:
        for slant in (0.0, 0.5):
            there = (columns + np.floor(slant * rows)) % 8 == 3
            phase = (2 - height_m * there) / float(tm.range_m(1.0, F_HZ))
            b = SIGNAL_DN * np.exp(1j * np.arange(ORDER + 1)[:, None, None] * phase)
            noise = tm.noise.moment_noise(
                b[0].real, sensor, calibration=np.ones(ORDER + 1), zeroth=ZEROTH
            )
            noisy = tm.noise.draw(b, noise, np.random.default_rng(SEED), draws=1)[:, 0]
            for name, way in _ways(noisy.astype(np.complex64), settings, None).items():
                seen, on = way.range_m[inner], there[inner]
                lower = np.nanmedian(seen[~on]) - np.nanmedian(seen[on])
                found.setdefault(name, []).append(float(lower) / height_m)
    table.notes.append(
        "Upright, and one column aside every second row; every part of a moment has about a "
        "hundredth of b_0 as its noise, and the range of a pixel alone one of 1 to 2 mm."
    )
    table.rows.extend((name, *(f"{each:.0%}" for each in kept)) for name, kept in found.items())
    return table


def _ways(moments: Array, settings: tm.Settings, gains: Array | None) -> dict[str, Way]:
    """Return the range by each way; those on ranges filter the one of moments as they are."""
    found = {}
    for name in NEIGHBOURS[::-1]:
        chosen = replace(settings, neighbours=name)

        def run(chosen: tm.Settings = chosen) -> tuple[Array, Array]:
            each = tm.Reconstruction(moments, chosen, calibration=gains)
            return np.asarray(each.range_m, float), np.asarray(each.range_std_m, float)

        (range_m, std_m), time_s = _timed(run)
        found[f"moments: {name}"] = Way(range_m, std_m, time_s)
    alone = found["moments: none"]
    std_m = float(np.nanmedian(alone.std_m))  # type: ignore[arg-type]  # of moments it is known
    filters: dict[str, Callable[[Array], Array]] = {
        "ranges: bilateral": partial(bilateral, std_m=std_m),
        "ranges: non-local means": partial(non_local_means, std_m=std_m),
        "ranges: domain transform": partial(domain_transform, delta_m=3 * std_m),
        "ranges: domain transform, holes filled": lambda z: filled(
            domain_transform(z, delta_m=3 * std_m)
        ),
    }
    for name, run_filter in filters.items():
        filtered, time_s = _timed(partial(run_filter, alone.range_m))
        found[name] = Way(filtered, None, alone.time_s + time_s)
    return found


def _timed(run: Callable[[], Any]) -> tuple[Any, float]:
    times_s, found = [], None
    for _ in range(REPEATED):
        start_s = time.process_time()
        found = run()
        times_s.append(time.process_time() - start_s)
    return found, float(np.median(times_s))


def _offsets(z: Array) -> Iterator[tuple[int, int, Array]]:
    """Yield the neighbours of all pixels; NaN outside of the picture."""
    height, width = z.shape
    wide = np.pad(z, REACH_PX, constant_values=np.nan)
    for row in range(2 * REACH_PX + 1):
        for column in range(2 * REACH_PX + 1):
            there = wide[row : row + height, column : column + width]
            yield row - REACH_PX, column - REACH_PX, there


def bilateral(z: Array, *, std_m: float, sigma_px: float = 1.5) -> Array:
    """Tomasi and Manduchi (1998): Gaussians of distance, and of range with 2 deviations of it."""
    total, mean = np.zeros_like(z), np.zeros_like(z)
    for row, column, there in _offsets(z):
        near = np.exp(-(row**2 + column**2) / (2 * sigma_px**2))
        weight = np.nan_to_num(near * np.exp(-((there - z) ** 2) / (2 * (2 * std_m) ** 2)))
        total, mean = total + weight, mean + weight * np.nan_to_num(there)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(z), mean / total, np.nan)


def non_local_means(z: Array, *, std_m: float, patch_px: int = 3) -> Array:
    """Buades, Coll and Morel (2005): weights by the distance of patches, less that of noise."""
    total, mean = np.zeros_like(z), np.zeros_like(z)
    for _, _, there in _offsets(z):
        apart = uniform_filter(np.nan_to_num((there - z) ** 2, nan=1e6), patch_px)
        weight = np.exp(-np.maximum(apart - 2 * std_m**2, 0) / std_m**2) * np.isfinite(there)
        total, mean = total + weight, mean + weight * np.nan_to_num(there)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(z), mean / np.maximum(total, 1e-300), np.nan)


def domain_transform(z: Array, *, delta_m: float, alpha: float = 0.5, rounds: int = 2) -> Array:
    """Gastal and Oliveira (2011), recursively, as stereo cameras' drivers have it.

    Along rows and columns, there and back, an exponential mean with weight ``alpha`` that begins
    anew where the range steps by ``delta_m`` or more.
    """
    z = z.copy()
    for _ in range(rounds):
        for view in (z.T, z.T[::-1], z, z[::-1]):  # in place, one line after another
            for last, line in pairwise(view):
                near = np.abs(line - last) < delta_m
                line[near] = alpha * line[near] + (1 - alpha) * last[near]
    return z


def filled(z: Array) -> Array:
    """Fill pixels without a range by the one to the left of them."""
    z = z.copy()
    for last, column in pairwise(z.T):
        column[...] = np.where(np.isnan(column), last, column)
    return z
