"""Figure 5: the zeroth moment governs sparsity (Sec. 4.3)."""

from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.synthetic import PIXEL

_M: Final = 5
_F_HZ: Final = 23e6
_NEAR: Final = 1e-4
"""How far above the singular b_0 the sparsest reconstruction is, over b_0."""
_LESS_NEAR: Final = 1e-3
_WINDOW_RAD: Final = 0.05
_RADIUS: Final = 0.93
"""Of the Poisson kernel that densities are smoothed with before they are compared (Sec. 5.2)."""


def make(bench: Bench) -> FigureResult:
    """Reconstruct the same b_1 to b_5 with different b_0."""
    phase = 2 * np.pi * np.arange(bench.few(20_000, 4000)) / bench.few(20_000, 4000)
    b = PIXEL.moments(_F_HZ, _M)
    singular = singular_brightness(b)
    sparsest = singular + _NEAR * PIXEL.brightness
    truth = PIXEL.density(phase / (2 * np.pi * _F_HZ)) / (2 * np.pi * _F_HZ)
    shown = (sparsest, singular + 0.4, PIXEL.brightness, 72.0, 85.0)
    swept = np.geomspace(sparsest - singular, 30.0, bench.few(61, 31)) + singular
    tried = [_density(b, b_0, phase) for b_0 in swept]
    errors = {
        "cumulative": np.array([_cumulative_error(each, truth) for each in tried]),
        "smoothed density": np.array([_error(each, truth) for each in tried]),
    }
    densities = {b_0: _density(b, b_0, phase) for b_0 in shown}
    less_near = _density(b, singular + _LESS_NEAR * PIXEL.brightness, phase)
    less_sparse = _concentrated(b, phase, less_near)
    return FigureResult(
        _draw(phase, truth, densities, swept, errors),
        _statements(b, phase, densities[sparsest], swept, errors),
        (_table(b, phase, truth, densities),),
        (
            "How nearly singular the matrix is decides how sparse: at a smallest eigenvalue of "
            f"{_LESS_NEAR:.1%} of b_0 the returns hold {less_sparse:.0%} of the light.",
            f"Our pixel is not the paper's: its matrix is singular at b_0 = {singular:.1f}, where "
            "theirs is nearly so at 61.",
        ),
    )


def singular_brightness(b: Array) -> float:
    """Return the b_0 at which the Toeplitz matrix of moments (m + 1) becomes singular."""
    return float(b[0].real - tm.smallest_eigenvalue(b[:, None])[0])


def _density(b: Array, b_0: float, phase: Array) -> Array:
    changed = np.concatenate([[b_0], b[1:]])
    density: Array = tm.density(tm.levinson(changed[:, None]), phase)[:, 0]
    return density


def _highest(b: Array, b_0: float) -> float:
    """Return the density of the highest peak, between the points of any grid."""
    changed = np.concatenate([[b_0], b[1:]])
    return float(tm.peaks(tm.levinson(changed[:, None])).density.max())


def _error(density: Array, truth: Array) -> float:
    """Return the distance of two smoothed densities over the true brightness.

    Unsmoothed, the distance of densities near sharp returns says nothing (Sec. 5.2): two returns
    apart by less than anything could resolve are as far from each other as they can be.
    """
    off = np.fft.rfft(density - truth)
    # the Poisson kernel's Fourier coefficients are r^|k|
    smoothed = np.fft.irfft(off * _RADIUS ** np.arange(off.size), n=truth.size)
    return float(np.abs(smoothed).mean() * 2 * np.pi / PIXEL.brightness)


def _cumulative_error(density: Array, truth: Array) -> float:
    """Return the mean distance of two cumulative densities over the true brightness."""
    step = 2 * np.pi / density.size
    return float(np.abs(np.cumsum(density - truth) * step).mean() / PIXEL.brightness)


def _concentrated(b: Array, phase: Array, density: Array) -> float:
    """Return the share of the light within a window around each of Pisarenko's m returns."""
    returns = tm.pisarenko(b[:, None])
    apart = phase[:, None] - returns.phase_rad[:, 0]
    near = (np.abs(np.remainder(apart + np.pi, 2 * np.pi) - np.pi) <= _WINDOW_RAD).any(axis=1)
    return float(density[near].sum() / density.sum())


def _statements(
    b: Array, phase: Array, sparsest: Array, swept: Array, errors: dict[str, Array]
) -> list[Statement]:
    best = {name: float(swept[each.argmin()]) for name, each in errors.items()}
    heights = [_highest(b, b_0) for b_0 in swept]
    fine = np.linspace(PIXEL.brightness, PIXEL.brightness * 1.001, 3)
    close = [_density(b, b_0, phase) for b_0 in fine]
    moved = [np.abs(close[1] - close[0]).mean(), np.abs(close[2] - close[0]).mean()]
    return [
        *(
            state(
                "05.best",
                abs(best[name] - PIXEL.brightness) / PIXEL.brightness,
                best=best[name],
                name=name,
            )
            for name in errors
        ),
        state("05.sparse", _concentrated(b, phase, sparsest), window_rad=_WINDOW_RAD, near=_NEAR),
        state("05.governs", float((np.diff(heights) < 0).mean())),
        state("05.continuous", float(moved[0] / moved[1])),
    ]


def _table(b: Array, phase: Array, truth: Array, densities: dict[float, Array]) -> Table:
    rows = []
    for b_0, density in densities.items():
        changed = np.concatenate([[b_0], b[1:]])
        rows.append(
            {
                "b_0": round(b_0, 2),
                "smallest eigenvalue": float(tm.smallest_eigenvalue(changed[:, None])[0]),
                "highest peak per rad": _highest(b, b_0),
                "distance from the truth": _error(density, truth),
                f"light within {_WINDOW_RAD} rad of m returns": _concentrated(b, phase, density),
            }
        )
    return Table.of("The same b_1 to b_5 with different b_0", rows)


def _draw(
    phase: Array,
    truth: Array,
    densities: dict[float, Array],
    swept: Array,
    errors: dict[str, Array],
) -> Any:
    with style.new(11.0, 3.8) as picture:
        curves, sweep = picture.subplots(1, 2, width_ratios=(2.2, 1.0))
        colours = ("#000000", style.FOURTH, style.OURS, style.OTHER, "#E69F00")
        curves.plot(phase, truth, color=style.TRUTH, linestyle=":", linewidth=2.2, label="truth")
        for (b_0, density), colour in zip(densities.items(), colours, strict=True):
            right = " (true)" if b_0 == PIXEL.brightness else ""
            curves.plot(phase, density, color=colour, linewidth=1.4, label=f"b₀ = {b_0:.1f}{right}")
        curves.set(xlim=(0, 2 * np.pi), ylim=(0, 3.2 * truth.max()), xlabel="φ / rad")
        curves.set(
            ylabel="h(φ) per rad", title="the same b₁ … b₅ with different b₀ (peaks cut off)"
        )
        curves.legend()
        sweep.plot(swept, errors["smoothed density"], color=style.OURS, label="density, smoothed")
        sweep.plot(swept, errors["cumulative"], color=style.OTHER, label="cumulative, mean")
        sweep.axvline(PIXEL.brightness, color=style.TRUTH, linestyle=":", label="true b₀")
        sweep.set(title="distance from the truth", xlabel="b₀", ylabel="over the true b₀")
        sweep.set(ylim=(0, None))
        sweep.legend()
    return picture


FIGURE: Final = figure(5, make)
