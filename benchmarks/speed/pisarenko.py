"""Pisarenko's returns against eigh and companion eigvals."""

from collections.abc import Iterator
from functools import partial

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import PAPER, VGA, moments, numpy_alone
from benchmarks.common.tables import Table, verdict
from benchmarks.common.timing import measure
from benchmarks.speed import obvious

_ORDERS = (3, 4, 8)


def tables() -> Iterator[Table]:
    """Measure eigenvalue, phases, weights and count on one core."""
    tm.kernels.compile()
    for name, shape in (("163 x 120", PAPER), ("640 x 480", VGA)):
        yield _table(name, shape)


def _table(name: str, shape: tuple[int, int]) -> Table:
    table = Table(
        f"Returns of all pixels, {name}, lanes on one core",
        ("m", "float32", "float64", "planar NumPy", "eigh + eigvals", "gain"),
        notes=["eigh + eigvals: LAPACK in complex64 through NumPy, on as many cores as it likes."],
    )
    for m in _ORDERS:
        b = moments(m, shape).reshape(m + 1, -1)
        wide = b.astype(np.complex128)
        single = measure(partial(tm.pisarenko, b))
        double = measure(partial(tm.pisarenko, wide))
        with numpy_alone():
            planar = measure(partial(tm.pisarenko, b), least_s=0.1)
        lapack = measure(partial(obvious.returns, obvious.toeplitz(b), b), least_s=0.1)
        gain = lapack.median_s / single.median_s
        table.rows.append(
            (str(m), str(single), str(double), str(planar), str(lapack), f"{gain:.0f}")
        )
        table.notes.append(verdict(gain, 120, f"m = {m}, times eigh + eigvals"))
    return table
