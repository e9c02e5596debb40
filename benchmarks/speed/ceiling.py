"""What this machine can do at best: multiply and add, and write memory.

A ceiling is the best of all repetitions, whatever else the machine was doing meanwhile.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.common.timing import measure
from transientcam_moments._kernels import simd

_ROUNDS = 1_000_000
_OFTEN = 50
_CHAINS = 12  # independent ones: more than latency times throughput

_Array = NDArray[np.float32]


@dataclass(frozen=True)
class Ceiling:
    """Rates of a number of cores together, in float32."""

    fused_s: float
    """Fused multiply-adds of single numbers a second."""
    cached_bytes_s: float
    """Bytes written a second to 4 MiB a core that are written again and again."""
    stream_bytes_s: float
    """Bytes written a second past the caches to 128 MiB a core."""


@njit(nogil=True, error_model="numpy")
def _fused(x: Any, rounds: int) -> None:
    one = simd.ones(x, 1)
    step = simd.width(one)
    scale, shift = simd.load(one, x, 12 * step), simd.load(one, x, 13 * step)
    a, b, c = simd.load(one, x, 0), simd.load(one, x, step), simd.load(one, x, 2 * step)
    d, e, f = a + shift, b + shift, c + shift
    g, h, i = d + shift, e + shift, f + shift
    j, k, m = g + shift, h + shift, i + shift
    for _ in range(rounds):
        a, b, c = a * scale + shift, b * scale + shift, c * scale + shift
        d, e, f = d * scale + shift, e * scale + shift, f * scale + shift
        g, h, i = g * scale + shift, h * scale + shift, i * scale + shift
        j, k, m = j * scale + shift, k * scale + shift, m * scale + shift
    simd.store(x, 0, a + b + c + d + e + f + g + h + i + j + k + m)


@njit(nogil=True, error_model="numpy")
def _write(x: Any, value: float, past_caches: bool) -> None:
    one = simd.ones(x, 1)
    step = simd.width(one)
    lanes = simd.spread(one, value)
    begin = simd.before_boundary(x, 0)
    for p in range(begin, x.shape[0] - step + 1, step):
        if past_caches:
            simd.stream(x, p, lanes)
        else:
            simd.store(x, p, lanes)
    simd.fence()


def measured(cores: int) -> Ceiling:
    """Measure the ceiling of so many cores at a time."""
    width = simd.REGISTER_BYTES // 4
    operands: list[_Array] = [np.full(14 * width, 0.5, np.float32) for _ in range(cores)]
    fused_s = _best_s(cores, lambda core: _fused(operands[core], _ROUNDS))
    small = [_room(1 << 22) for _ in range(cores)]
    cached_s = _best_s(cores, lambda core: _write_often(small[core]))
    large = [_room(1 << 27) for _ in range(cores)]
    stream_s = _best_s(cores, lambda core: _write(large[core], 1.0, True))
    return Ceiling(
        cores * _ROUNDS * _CHAINS * width / fused_s,
        cores * _OFTEN * (1 << 22) / cached_s,
        cores * (1 << 27) / stream_s,
    )


def _room(size: int) -> _Array:
    return np.zeros(size // 4, np.float32)


def _write_often(x: _Array) -> None:
    for _ in range(_OFTEN):
        _write(x, 1.0, False)


def together(cores: int, work: Callable[[int], object]) -> None:
    """Have each of so many cores do its part at the same time."""
    threads = [threading.Thread(target=work, args=(core,)) for core in range(1, cores)]
    for thread in threads:
        thread.start()
    work(0)
    for thread in threads:
        thread.join()


def _best_s(cores: int, work: Callable[[int], object]) -> float:
    """Return the seconds that a part takes with every core at work."""
    return measure(lambda: together(cores, work)).best_s
