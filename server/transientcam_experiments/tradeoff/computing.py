"""Computing time against numerical error: estimators, precision, forms of evaluation."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_experiments.tradeoff.grid import Grid

_Array = NDArray[Any]
_Clock = Callable[[], float]
EXACT_PIXELS: Final = 8
"""Pixels whose density is computed with 50 digits."""
QUADRATURE_POINTS: Final = (256, 4096)
_DIGITS: Final = 50
_BLOCK_PIXELS: Final = 1024

QUANTITIES: Final[dict[str, str]] = {
    "seconds": "computing time of one frame, median",
    "error_median": "numerical error of a typical pixel",
    "error_worst": "numerical error of the worst pixel",
}


@dataclass(frozen=True, slots=True)
class Task:
    """Something that is computed of a frame.

    ``run`` takes moments and gives an array with pixels last; ``exact`` gives what it should be.
    """

    point: Mapping[str, Any]
    run: Callable[[_Array], _Array]
    exact: Callable[[_Array], _Array]


def tasks(harmonics: int, grid: Grid) -> Iterator[Task]:
    """Yield everything that is measured of moments (m + 1, ...) in double precision."""

    def point(task: str, method: str, dtype: str, **bins: int) -> dict[str, Any]:
        return {"task": task, "method": method, "dtype": dtype, "harmonics": harmonics, **bins}

    for name, run in _ESTIMATORS.items():
        for dtype in ("float32", "float64"):
            yield Task(point("range", name, dtype), _as(dtype, run), run)
    for bins in grid.bins:
        phase = 2 * np.pi * np.arange(bins) / bins
        for dtype in ("float32", "float64"):
            for form in ("modulus", "fourier"):
                yield Task(
                    point("density", form, dtype, bins=bins),
                    _as(dtype, _density(phase, form)),
                    _exact(_density_with_digits, phase, _density(phase, "modulus"))
                    if dtype == "float64"
                    else _density(phase, "modulus"),
                )
            closed = _closed_form(phase)
            yield Task(
                point("cumulative", "closed form", dtype, bins=bins),
                _as(dtype, closed),
                _exact(_cumulative_with_digits, phase, closed) if dtype == "float64" else closed,
            )
    phase = 2 * np.pi * np.arange(grid.bins[0]) / grid.bins[0]
    for points in QUADRATURE_POINTS:
        yield Task(
            point("cumulative", f"quadrature, {points} points", "float32", bins=grid.bins[0]),
            _as("float32", _quadrature(phase, points)),
            _closed_form(phase),
        )


def measure(
    task: Task, b: _Array, *, repetitions: int, clock: _Clock = time.perf_counter
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """Return median and spread of the time of a task, and its error."""
    typed = b if task.point["dtype"] == "float64" else b.astype(np.complex64)
    result = task.run(typed)  # compiles what it needs, and fills caches
    times = []
    for _ in range(repetitions):
        begin = clock()
        task.run(typed)
        times.append(clock() - begin)
    some = b.reshape((b.shape[0], -1))[:, :: max(1, b[0].size // 400)]
    exact = task.exact(some)
    ours = task.run(some if typed is b else some.astype(np.complex64))[..., : exact.shape[-1]]
    error = _error(ours, exact, turns=task.point["task"] == "range")
    values: dict[str, float | None] = {
        "seconds": float(np.median(times)),
        "error_median": float(np.median(error)),
        "error_worst": float(error.max()),
        "result_bytes": float(result.nbytes),
    }
    spread: dict[str, float | None] = dict.fromkeys(values)
    spread["seconds"] = float(np.std(times, ddof=1)) if repetitions > 1 else None
    return values, spread


def _error(ours: _Array, exact: _Array, *, turns: bool) -> _Array:
    """Return each pixel's largest error, over its largest value; of phases, in radian."""
    if turns:
        off = np.abs(np.angle(np.exp(1j * (ours.astype(float) - exact))))
        turned: _Array = off[np.isfinite(off)]
        return turned
    off = np.abs(ours - exact).max(axis=0) / np.abs(exact).max(axis=0)
    finite: _Array = off[np.isfinite(off)]
    return finite


def _as(dtype: str, run: Callable[[_Array], _Array]) -> Callable[[_Array], _Array]:
    kind = np.complex64 if dtype == "float32" else np.complex128
    return lambda b: run(b if b.dtype == kind else b.astype(kind))


def _pisarenko(b: _Array) -> _Array:
    return np.asarray(tm.separate(tm.pisarenko(b)).phase_rad)


def _maximum_entropy(b: _Array) -> _Array:
    return np.asarray(tm.peaks(tm.levinson(b)).first_rad)


def _single_frequency(b: _Array) -> _Array:
    return np.asarray(np.remainder(np.angle(b[1]), 2 * np.pi))


_ESTIMATORS: Final[dict[str, Callable[[_Array], _Array]]] = {
    "single frequency": _single_frequency,
    "Pisarenko": _pisarenko,
    "maximum entropy": _maximum_entropy,
}


def _density(phase: _Array, form: str) -> Callable[[_Array], _Array]:
    return lambda b: np.asarray(tm.density(tm.levinson(b), phase, evaluation=form))


def _closed_form(phase: _Array) -> Callable[[_Array], _Array]:
    return lambda b: np.asarray(tm.cumulative(tm.levinson(b), phase))


def _quadrature(phase: _Array, points: int) -> Callable[[_Array], _Array]:
    """Midpoint rule on equal steps, as where no closed form is at hand."""
    at = 2 * np.pi * (np.arange(points) + 0.5) / points
    edge = np.rint(phase * points / (2 * np.pi)).astype(int)

    def run(b: _Array) -> _Array:
        flat = b.reshape((b.shape[0], -1))
        result = np.empty((len(phase), flat.shape[1]), dtype=np.real(b).dtype)
        for start in range(0, flat.shape[1], _BLOCK_PIXELS):
            block = slice(start, start + _BLOCK_PIXELS)
            heights = tm.density(tm.levinson(flat[:, block]), at)
            summed = np.cumsum(heights, axis=0) * (2 * np.pi / points)
            result[:, block] = np.where(edge[:, None] > 0, summed[edge - 1], 0)
        return result.reshape((len(phase), *b.shape[1:]))

    return run


def _exact(
    with_digits: Callable[[Any, _Array, _Array], list[float]],
    phase: _Array,
    otherwise: Callable[[_Array], _Array],
) -> Callable[[_Array], _Array]:
    """Compute a few pixels with 50 digits; where mpmath is missing, in double precision."""

    def exact(b: _Array) -> _Array:
        few = b[:, :EXACT_PIXELS]
        try:
            import mpmath
        except ModuleNotFoundError:
            return otherwise(few)
        with mpmath.workdps(_DIGITS):
            pixels = [with_digits(mpmath, column, phase) for column in few.T]
        return np.array(pixels).T

    return exact


def _solved(mpmath: Any, b: _Array) -> Any:
    """Solve B q = e_0 (Theorem 1)."""
    n = len(b)
    matrix = mpmath.matrix(n, n)
    for j in range(n):
        for k in range(n):
            value = mpmath.mpc(complex(b[abs(j - k)]))
            matrix[j, k] = value if j >= k else mpmath.conj(value)
    return mpmath.lu_solve(matrix, mpmath.matrix([1] + [0] * (n - 1)))


def _density_with_digits(mpmath: Any, b: _Array, phase: _Array) -> list[float]:
    """Eq. (2), with q = B^-1 e_0."""
    q = _solved(mpmath, b)
    heights = []
    for each in phase.tolist():
        z = mpmath.expj(mpmath.mpf(each))
        around = mpmath.fsum(mpmath.conj(q[j]) * z**j for j in range(len(b)))
        heights.append(float(mpmath.re(q[0]) / (2 * mpmath.pi * abs(around) ** 2)))
    return heights


def _cumulative_with_digits(mpmath: Any, b: _Array, phase: _Array) -> list[float]:
    """Integrate the density's Fourier series over its poles p_l, b_k = sum_l C_l p_l^k."""
    q, m = _solved(mpmath, b), len(b) - 1
    companion = mpmath.matrix(m, m)
    for j in range(m):
        companion[0, j] = -q[j + 1] / q[0]
        if j:
            companion[j, j - 1] = 1
    poles = mpmath.eig(companion, left=False, right=False)
    powers = mpmath.matrix(m, m)
    for k in range(m):
        for each in range(m):
            powers[k, each] = poles[each] ** (k + 1)
    right = mpmath.matrix([mpmath.mpc(complex(value)) for value in b[1:]])
    factors = mpmath.lu_solve(powers, right)

    def primitive(x: Any) -> Any:
        turn = mpmath.expj(-x)
        return mpmath.fsum(factors[each] * mpmath.log(1 - poles[each] * turn) for each in range(m))

    start, summed = primitive(mpmath.mpf(0)), []
    for each in phase.tolist():
        x = mpmath.mpf(each)
        wave = 2 * mpmath.re((primitive(x) - start) / mpmath.mpc(0, 1))
        summed.append(float((mpmath.mpf(float(b[0].real)) * x + wave) / (2 * mpmath.pi)))
    return summed
