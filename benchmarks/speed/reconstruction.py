"""The whole reconstruction from raw images, against batched LAPACK, SciPy and JAX."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import solve_toeplitz

import transientcam_moments as tm
from benchmarks.common.data import (
    CORES,
    PAPER,
    SETTINGS,
    VGA,
    Array,
    images,
    moments,
    numpy_alone,
    reconstructor,
)
from benchmarks.common.tables import Table, verdict
from benchmarks.common.timing import Timing, duration, measure
from benchmarks.speed import obvious

_M = 4
_SAMPLE = 2000


def tables() -> Iterator[Table]:
    """Measure m = 4 in single precision."""
    tm.kernels.compile()
    yield _whole()
    yield _coefficients()


def _whole() -> Table:
    table = Table(
        f"Raw images to coefficients, range, direct, indirect and validity, m = {_M}, float32",
        ("", "163 x 120", "frames/s", "640 x 480", "frames/s"),
        notes=["Smoothing, biasing and flags included; kernels redo ill pixels in float64."],
    )
    timings: dict[str, list[Timing]] = {}
    for shape in (PAPER, VGA):
        raw = images(_M, shape)
        for name, call in _ways(raw):
            least_s = 0.1 if name.startswith("batched") else 1.0
            timings.setdefault(name, []).append(measure(call, least_s=least_s))
    for name, (small, large) in timings.items():
        rates = [f"{1 / timing.median_s:.4g}" for timing in (small, large)]
        table.rows.append((name, str(small), rates[0], str(large), rates[1]))
    kernels, slow = (
        timings[f"kernels, {CORES} cores"],
        timings["batched LAPACK (solve, eigh, eigvals)"],
    )
    for size, ours, theirs in zip(("163 x 120", "640 x 480"), kernels, slow, strict=True):
        gain = theirs.median_s / ours.median_s
        table.notes.append(verdict(gain, 60, f"{size}, times batched LAPACK"))
    table.notes.append(verdict(1 / kernels[1].median_s, 40, "640 x 480, frames/s"))
    return table


def _ways(raw: Array) -> Iterator[tuple[str, Callable[[], object]]]:
    made = reconstructor(_M)
    yield "kernels, 1 core", lambda: _read(made(raw))
    with ThreadPoolExecutor(max(1, CORES - 1)) as executor:
        spread = tm.kernels.over(executor, CORES)
        yield f"kernels, {CORES} cores", lambda: _read(made(raw, spread=spread))
    with numpy_alone():
        yield "planar NumPy", lambda: _read(made(raw))
    yield "batched LAPACK (solve, eigh, eigvals)", partial(obvious.reconstruct, raw, SETTINGS)


def _read(found: tm.Reconstruction) -> tuple[object, ...]:
    """Have everything computed."""
    light = found.direct, found.indirect
    return found.coefficients, found.range_m, *light, found.validity, found.flags


def _coefficients() -> Table:
    table = Table(
        f"Moments to coefficients and returns, 163 x 120, m = {_M}, float32",
        ("", "coefficients", "returns"),
        notes=[f"SciPy solves one matrix a call: extrapolated from {_SAMPLE} pixels."],
    )
    b = moments(_M, PAPER).reshape(_M + 1, -1)
    matrix = obvious.toeplitz(b)
    table.rows.append(("kernels, 1 core", *_pair(lambda: tm.levinson(b), lambda: tm.pisarenko(b))))
    with numpy_alone():
        table.rows.append(("planar NumPy", *_pair(lambda: tm.levinson(b), lambda: tm.pisarenko(b))))
    table.rows.append(("JAX on the CPU, jitted", *_jax(b)))
    table.rows.append(
        (
            "batched LAPACK through NumPy",
            *_pair(
                lambda: obvious.coefficients(obvious.toeplitz(b)),
                lambda: obvious.returns(matrix, b),
            ),
        )
    )
    table.rows.append(("scipy.linalg.solve_toeplitz", _scipy(b), ""))
    return table


def _pair(first: Callable[[], object], second: Callable[[], object]) -> tuple[str, str]:
    return str(measure(first)), str(measure(second))


def _scipy(b: Array) -> str:
    unit = np.zeros(len(b), b.dtype)
    unit[0] = 1
    return _one_by_one(b, lambda column: solve_toeplitz((column, column.conj()), unit))


def _one_by_one(b: Array, solve: Callable[[Array], object]) -> str:
    start_s = time.perf_counter()
    for pixel in range(_SAMPLE):
        solve(b[:, pixel])
    return duration((time.perf_counter() - start_s) * b.shape[1] / _SAMPLE)


def _jax(b: Array) -> tuple[str, str]:
    import jax

    def compiled(function: Callable[[Any], Any]) -> Callable[[], object]:
        jitted, planes = jax.jit(function), jax.numpy.asarray(b)
        wait: Any = jax.block_until_ready  # unannotated
        return lambda: wait(jitted(planes))

    return _pair(compiled(tm.levinson), compiled(tm.pisarenko))
