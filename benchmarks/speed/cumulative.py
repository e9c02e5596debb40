"""The closed-form cumulative density against quadrature with 1e5 points."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.integrate import cumulative_trapezoid

import transientcam_moments as tm
from benchmarks.common.data import Array, moments
from benchmarks.common.tables import Table
from benchmarks.common.timing import duration, measure

_PIXELS = 40
_POINTS = 100_001
_PHASES = 32


def tables() -> Iterator[Table]:
    """Measure seconds a pixel and the error against a finer quadrature, in float64."""
    tm.kernels.compile()
    table = Table(
        f"Cumulative density at {_PHASES} phases, float64, a pixel",
        ("m", "closed form", "its error", "quadrature, 1e5 points", "its error", "gain"),
        notes=[
            "Errors relative to b_0, the worst of all pixels, against Gauss's rule on panels that "
            "close in on each peak.",
            "The closed form costs the same wherever the peaks are; quadrature errs at sharp ones.",
        ],
    )
    for m in (3, 4, 8):
        wide = moments(m, (64, 64)).reshape(m + 1, -1)[:, ::37].astype(complex)
        c = tm.levinson(wide)
        few = tm.Coefficients(
            c.error[:_PIXELS], c.polynomial[:, :_PIXELS], c.reflection[:, :_PIXELS]
        )
        grid = np.linspace(0, 2 * np.pi, _POINTS)
        at = grid[(_POINTS - 1) // _PHASES :: (_POINTS - 1) // _PHASES]
        exact = _exact(few, at)
        closed_s = measure(partial(tm.cumulative, c, at)).median_s / c.error.size
        quadrature_s = measure(partial(_trapezoid, few, grid), least_s=0.1).median_s
        closed_error = np.abs(tm.cumulative(few, at) - exact).max(axis=0) / few.brightness
        coarse = _trapezoid(few, grid)[(_POINTS - 1) // _PHASES :: (_POINTS - 1) // _PHASES]
        coarse_error = np.abs(coarse - exact).max(axis=0) / few.brightness
        table.rows.append(
            (
                str(m),
                duration(closed_s),
                f"{closed_error.max():.1e}",
                duration(quadrature_s / _PIXELS),
                f"{coarse_error.max():.1e}",
                f"{quadrature_s / _PIXELS / closed_s:.0f}",
            )
        )
    yield table


def _trapezoid(c: tm.Coefficients, grid: Array) -> Array:
    integral: Array = cumulative_trapezoid(tm.density(c, grid), grid, axis=0, initial=0)
    return integral


def _exact(c: tm.Coefficients, at: Array) -> Array:
    """Integrate by Gauss's rule on panels that get ever shorter towards the angle of each pole."""
    node, weight = np.polynomial.legendre.leggauss(20)
    found = np.empty((at.size, c.error.size))
    for pixel in range(c.error.size):
        one = tm.Coefficients(c.error[[pixel]], c.polynomial[:, [pixel]], c.reflection[:, [pixel]])
        angles = np.angle(np.roots(c.polynomial[:, pixel]))[:, None]
        towards = angles + np.array([-1, 1])[:, None, None] * 2.0 ** -np.arange(30)
        edges = np.concatenate([np.linspace(0, 2 * np.pi, 65), towards.reshape(-1) % (2 * np.pi)])
        edges = np.unique(np.concatenate([edges, angles[:, 0] % (2 * np.pi), at]))
        half = np.diff(edges) / 2
        points = edges[:-1, None] + half[:, None] * (node + 1)
        density = tm.density(one, points.reshape(-1)).reshape(points.shape)
        total = np.concatenate([[0], np.cumsum((density @ weight) * half)])
        found[:, pixel] = total[np.searchsorted(edges, at)]
    return found
