"""What each stage of the reconstruction costs, and what a second precision would."""

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import PAPER, VGA, constants, images, lane, moments, numpy_alone
from benchmarks.common.tables import Table
from benchmarks.common.timing import duration, measure
from transientcam_moments._kernels.one_pass import OnePass
from transientcam_moments._kernels.reconstruct import reconstruct_stages

_ORDERS = (3, 4, 8)
_FRAMES = 15
_STAGES = {
    "measure_and_smooth": "four-bucket, calibration, smoothing",
    "analyse": "smallest eigenvalue, flags, biasing, returns",
    "wide": "redone in float64",
    "separate": "direct, indirect, range",
}


def tables() -> Iterator[Table]:
    """Measure on one core."""
    tm.kernels.compile()
    yield _profile()
    yield _precisions()
    yield _evaluations()


def _profile() -> Table:
    table = Table(
        "Cost per stage, 640 x 480, one core, float32 (ns a pixel)",
        ("stage", *(f"m = {m}" for m in _ORDERS)),
    )
    columns = [_spent(m) for m in _ORDERS]
    for stage in dict.fromkeys(_STAGES.values()):
        table.rows.append((stage, *(f"{column[stage]:.2f}" for column, _ in columns)))
    table.rows.append(("all", *(f"{sum(column.values()):.2f}" for column, _ in columns)))
    table.rows.append(("pixels redone", *(f"{share:.2%}" for _, share in columns)))
    return table


def _spent(m: int) -> tuple[dict[str, float], float]:
    """Return ns a pixel of each stage, and the share of pixels that were redone."""
    spent = dict.fromkeys(_STAGES, 0.0)

    def timed(name: str, entry: Callable[..., Any]) -> Callable[..., Any]:
        def run(*arguments: Any) -> Any:
            start_s = time.perf_counter()
            result = entry(*arguments)
            spent[name] += time.perf_counter() - start_s
            return result

        return run

    stages = reconstruct_stages(m)
    watched: dict[str, Any] = {name: timed(name, getattr(stages, name)) for name in _STAGES}
    watched["wide"].room = stages.wide.room
    one_pass = OnePass(stages._replace(**watched), VGA, constants(m))
    raw = images(m, VGA)
    best, redone = dict.fromkeys(_STAGES, np.inf), 0
    for _ in range(_FRAMES):
        spent.update(dict.fromkeys(_STAGES, 0.0))
        redone = one_pass.images(raw, None, tm.kernels.at_once).redone
        best = {name: min(best[name], spent[name]) for name in _STAGES}
    pixels = VGA[0] * VGA[1]
    columns = dict.fromkeys(_STAGES.values(), 0.0)
    for name, stage in _STAGES.items():
        columns[stage] += best[name] / pixels * 1e9
    return columns, redone / pixels


def _precisions() -> Table:
    table = Table(
        "float32 against float64, 163 x 120, lanes on one core",
        ("", *(f"m = {m}, float{bits}" for m in _ORDERS for bits in (32, 64))),
        notes=["Density: a frame out of 64."],
    )
    rows: dict[str, list[str]] = {"levinson": [], "smallest eigenvalue": [], "density": []}
    phase_rad = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    for m in _ORDERS:
        for dtype in (np.complex64, np.complex128):
            b = moments(m, PAPER, dtype).reshape(m + 1, -1)
            c = tm.levinson(b)
            out = np.empty((64, b.shape[1]), c.error.dtype)
            evaluate = lane("density", c.polynomial)
            density = partial(evaluate, c.polynomial, c.reflection, c.error, phase_rad, out)
            rows["levinson"].append(str(measure(partial(tm.levinson, b))))
            rows["smallest eigenvalue"].append(str(measure(partial(tm.smallest_eigenvalue, b))))
            rows["density"].append(duration(measure(density).median_s / 64))
    table.rows.extend((name, *row) for name, row in rows.items())
    return table


def _evaluations() -> Table:
    table = Table(
        "Density by squared modulus or by Fourier series, planar NumPy, 163 x 120, 64 frames",
        ("m", "modulus", "its worst error", "fourier", "its worst error"),
        notes=["Errors relative to float64, over all pixels and phases: float32."],
    )
    phase_rad = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    for m in _ORDERS:
        c = tm.levinson(moments(m, PAPER).reshape(m + 1, -1))
        wide = tm.Coefficients(
            c.error.astype(float), c.polynomial.astype(complex), c.reflection.astype(complex)
        )
        exact = tm.density(wide, phase_rad)
        row = [str(m)]
        for evaluation in ("modulus", "fourier"):
            found = tm.density(c, phase_rad, evaluation=evaluation)
            worst = float(np.abs(found / exact - 1).max())
            # the lane stands beside the modulus only: both are compared without it
            with numpy_alone():
                timing = measure(partial(tm.density, c, phase_rad, evaluation=evaluation))
            row += [str(timing), f"{worst:.1e}"]
        table.rows.append(row)
    return table
