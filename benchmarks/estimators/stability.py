"""How exact the mathematics is in its hard cases."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.picture import blank, saved
from benchmarks.common.tables import Table, heads
from benchmarks.common.timing import measure
from tests.moments import oracles
from tests.stability import exact
from tests.stability.cases import ORDERS, PRECISIONS, Signal, dense_signals, sparse_signals
from transientcam_moments.arrays import by_blocks
from transientcam_moments.moment_problem import first_returns
from transientcam_moments.moment_problem._polishing import residual, size

Complex = NDArray[np.complexfloating]
Worst = dict[str, tuple[float, int]]
COLOURS = {"float32": "#d55e00", "float64": "#0072b2"}  # distinct to colour-blind readers, too


def note(worst: Worst, name: str, value: float, m: int) -> None:
    """Keep the largest value and the order it came from."""
    if value > worst.get(name, (-1.0, 0))[0]:
        worst[name] = value, m


def sparse_errors(signal: Signal, m: int, dtype: type) -> Iterator[tuple[str, float]]:
    """Yield errors of sharp returns: forward, what their condition allows, and backward."""
    b = exact.rounded(signal.moments(m), dtype)
    found = tm.pisarenko(b)
    again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), found.weight, m)
    again[0] += found.uniform
    yield "returns, backward", float(np.abs(again - b).max() / b[0].real)
    eigenvalue = abs(float(found.uniform) - float(signal.uniform)) / float(b[0].real)
    yield "smallest eigenvalue", eigenvalue
    phase, weight = np.array(signal.phase, float), np.array(signal.weight, float)
    by_phase, by_weight = exact.conditions(signal.phase, signal.weight, len(phase))
    kept = found.weight > 0.3 * weight.min()
    if kept.sum() == phase.size:
        order = np.argsort(phase)
        yield (
            "phase / rad",
            float(oracles.around(np.sort(found.phase_rad[kept]) - phase[order]).max()),
        )
        yield "weight, relative", float(np.abs(found.weight[kept] / weight[order] - 1).max())
        eps = float(np.finfo(dtype).eps)
        yield "phase, its condition times eps", eps * max(by_phase)
        yield "weight, its condition times eps", eps * max(by_weight)


def dense_errors(signal: Signal, m: int, dtype: type) -> Iterator[tuple[str, float]]:
    """Yield backward errors of the density's coefficients."""
    b = exact.rounded(signal.moments(m), dtype)
    share = float(tm.smallest_eigenvalue(b) / b[0].real)
    if share < 100 * np.finfo(dtype).eps:
        return
    c = tm.levinson(b)
    reflection = exact.exactly(c.reflection)
    b0 = mp.mpf(float(c.error))
    for g in reflection:
        b0 /= 1 - abs(g) ** 2
    given = exact.exactly(b)
    again = exact.moments_of_reflection(b0, reflection)
    yield "reflection coefficients, backward", exact.distance(again, given)
    again = exact.moments_of_polynomial(mp.mpf(float(c.error)), exact.exactly(c.polynomial))
    yield "polynomial, backward", exact.distance(again, given)
    yield "polynomial, eps over the uniform share", float(np.finfo(dtype).eps) / share


def case_table(
    title: str,
    signals: Callable[[int], Iterator[Signal]],
    errors: Callable[[Signal, int, type], Iterator[tuple[str, float]]],
) -> Table:
    """Collect the worst error of each case, method and precision over all orders."""
    table = Table(title, ("case: method", "float32 (at m)", "float64 (at m)"))
    worst: dict[str, Worst] = {name: {} for name in PRECISIONS}
    for m in ORDERS:
        for signal in signals(m):
            for precision, dtype in PRECISIONS.items():
                for method, value in errors(signal, m, dtype):
                    note(worst[precision], f"{signal.name}: {method}", value, m)
    for row in sorted({*worst["float32"], *worst["float64"]}):
        cells = [worst[p].get(row) for p in PRECISIONS]
        table.rows.append(
            (row, *("unresolved" if c is None else f"{c[0]:.1e} ({c[1]})" for c in cells))
        )
    return table


def fates() -> Table:
    """Show what hard pixels get, at m = 3 in single precision."""
    pixels = {
        "no light": [0, 0, 0, 0],
        "uniform": [1, 0, 0, 0],
        "one return": [1, 1, 1, 1],
        "b_0 too small by half": [0.5, 1, 1, 1],
        "contradicting": [1, 0.9, -0.9, 0.9],
        "subnormal": [1e-40, 5e-41, 0, 0],
        "NaN in a plane": [1, np.nan, 0, 0],
        "infinity in a plane": [1, 0, np.inf, 0],
        "saturated planes": [1, 1, -1j, -1],
    }
    b: Complex = np.array(list(pixels.values()), np.complex64).T
    flags, returns, coefficients = tm.flags(b), tm.pisarenko(b), tm.levinson(b)
    biased = tm.pisarenko(tm.bias(b).moments)
    table = Table(
        "What hard pixels get (m = 3, float32)",
        ("pixel", "flag", "returns", "uniform", "E", "returns after biasing"),
    )
    for k, name in enumerate(pixels):
        table.rows.append(
            (
                name,
                tm.Flags(int(flags[k])).name or "VALID",
                f"{returns.count[k]}",
                f"{returns.uniform[k]:.2g}",
                f"{coefficients.error[k]:.2g}",
                f"{biased.count[k]}",
            )
        )
    table.notes.append("Nothing raises, and no pixel changes its neighbours.")
    return table


def _many_returns(m: int) -> Iterator[tuple[str, str, str]]:
    """Yield how well 1 to m returns at random places explain their moments, by precision."""
    pixels = 20_000
    random = np.random.default_rng(m)
    there = np.arange(m)[:, None] <= np.arange(pixels) % m
    weight = random.uniform(0.05, 1, (m, pixels)) * there
    b = oracles.moments_of_returns(random.uniform(0, 2 * np.pi, (m, pixels)), weight, m)
    for precision, dtype in PRECISIONS.items():
        given: Complex = b.astype(dtype)
        found = tm.pisarenko(given)
        phase = np.where(found.weight > 0, found.phase_rad, 0).astype(float)
        again = oracles.moments_of_returns(phase, found.weight.astype(float), m)
        error = np.abs(again - given)[1:].max(axis=0) / b[0].real
        limit = 64 * (m + 1) * float(np.finfo(dtype).eps)
        yield (
            f"m = {m}, 1 to {m} random returns, {precision}: worst residual over b_0; "
            f"share above 64 (m + 1) eps",
            "-",
            f"{error.max():.1e}; {np.mean(error > limit):.2%}",
        )


def targets() -> Table:
    """Compare what was asked for with what came out."""
    table = Table("Targets", ("target", "asked for", "measured"))
    worst_phase = worst_weight = 0.0
    for m in (1, 2, 3, 4):
        phase, weight = oracles.random_returns(
            np.random.default_rng(m), returns=m, pixels=20_000, apart_rad=0.05
        )
        found = tm.pisarenko(oracles.moments_of_returns(phase, weight, m))
        # more than two returns within 0.4 rad: double precision itself has fewer digits
        nearest = np.sort(oracles.around(np.diff(phase, axis=0, append=phase[:1])), axis=0)
        open_space = (nearest[:2].sum(axis=0) >= 0.4) | (m <= 2)
        phase_error = oracles.around(found.phase_rad - phase).max(axis=0)
        weight_error = np.abs(found.weight / weight - 1).max(axis=0)
        worst_phase = max(worst_phase, float(phase_error[open_space].max()))
        worst_weight = max(worst_weight, float(weight_error[open_space].max()))
        if m == 4:
            crowded = float(phase_error.max()), float(weight_error.max())
    rows = [
        ("m <= 4 returns 0.05 rad apart, float64: phase", "1e-9", f"{worst_phase:.1e}"),
        ("the same: relative weight", "1e-8", f"{worst_weight:.1e}"),
        (
            "the same with 3 or 4 of the returns crowded: phase; weight",
            "-",
            f"{crowded[0]:.1e}; {crowded[1]:.1e}",
        ),
    ]
    rows += list(_many_returns(8))
    for precision, margin, bar in (("float64", 1e-6, "1e-12"), ("float32", 4e-3, "2e-5")):
        worst: Worst = {}
        for m in ORDERS:
            for signal in dense_signals(m):
                b = exact.rounded(signal.moments(m), PRECISIONS[precision])
                if tm.smallest_eigenvalue(b) >= margin * b[0].real:
                    for method, value in dense_errors(signal, m, PRECISIONS[precision]):
                        note(worst, method, value, m)
        for method in ("reflection coefficients, backward", "polynomial, backward"):
            text = f"{precision}, lambda >= {margin:g} b_0: {method}"
            rows.append((text, bar, f"{worst[method][0]:.1e}"))
    table.rows.extend(rows)
    table.notes.append(
        "A polynomial in double precision cannot meet 1e-12 at lambda = 1e-6 b_0: rounding its "
        "coefficients alone changes the light in a peak by eps / lambda. The reflection "
        "coefficients say the same density without that loss (`from_reflection`). The laws that "
        "have no number (bounds against linear programs, 10^7 random pixels without NaN, no jump "
        "at a switch) are tests."
    )
    return table


def helped() -> Table:
    """Count the pixels that need double precision, and say what it costs."""
    table = Table(
        "Single precision helped by double (163 x 120 pixels)",
        heads("signal | m | pixels redone:.2% | closed form, ms:.1f | with help, ms:.1f"),
    )
    rng = np.random.default_rng(0)
    for m in (3, 4, 8):
        noisy = oracles.random_moments(rng, m, 163 * 120, noise=0.02)
        sparse = oracles.moments_of_returns(
            *oracles.random_returns(rng, returns=m, pixels=163 * 120), m
        )
        for name, moments in (("noisy", tm.bias(noisy).moments), ("exactly m returns", sparse)):
            b: Complex = moments.astype(np.complex64)
            plain = by_blocks(first_returns, b)
            tolerance = 16 * (m + 1) * np.finfo(np.float32).eps
            redone = size(residual(b, *plain[:3]), b) > tolerance
            alone = measure(partial(by_blocks, first_returns, b)).median_s
            whole = measure(partial(tm.pisarenko, b)).median_s
            table.rows.append((name, m, redone.mean(), 1e3 * alone, 1e3 * whole))
    return table


def plot_separation(path: Path) -> None:
    """Draw the error against the separation of two returns."""
    apart = np.geomspace(1, 1e-5, 60)
    figure = blank(10, 4)
    axes = figure.subplots(1, 2, sharex=True)
    for precision, dtype in PRECISIONS.items():
        phase = np.stack([np.full(apart.size, 2.0), 2.0 + apart])
        weight = np.array([[1.0], [0.6]]) * np.ones(apart.size)
        eps = float(np.finfo(dtype).eps)
        # many turns of the same pair, so that rounding falls in all ways
        worst = np.zeros((2, apart.size))
        for shift in np.linspace(0, 3, 40):
            b: Complex = oracles.moments_of_returns(phase + shift, weight, 4).astype(dtype)
            found = tm.pisarenko(b)
            both = found.count == 2
            error = oracles.around(found.phase_rad[:2] - phase - shift).max(axis=0)
            worst[0] = np.maximum(worst[0], np.where(both, error, np.nan))
            error = np.abs(found.weight[:2] / weight - 1).max(axis=0)
            worst[1] = np.maximum(worst[1], np.where(both, error, np.nan))
        conditions = np.array(
            [
                [max(part) for part in exact.conditions((mp.mpf(2), 2 + mp.mpf(x)), W, 2)]
                for x in apart.tolist()
            ]
        ).T
        for axis, error, condition in zip(axes, worst, conditions, strict=True):
            axis.loglog(apart, error, ".", color=COLOURS[precision], label=precision)
            axis.loglog(apart, eps * condition, color=COLOURS[precision], lw=0.8)
    axes[0].set_ylabel("worst phase error / rad")
    axes[1].set_ylabel("worst relative weight error")
    for axis in axes:
        axis.set_xlabel("separation of two returns / rad (m = 4)")
        axis.set_ylim(1e-17, 10)
        axis.grid(alpha=0.3)
    axes[0].legend(title="line: condition times eps")
    path.write_bytes(saved(figure, "png"))


W = (mp.mpf(1), mp.mpf("0.6"))


def plot_condition(path: Path) -> None:
    """Draw the error against the condition number of random sparse signals."""
    figure = blank(6, 4.5)
    axis = figure.subplots()
    rng = np.random.default_rng(0)
    for precision, dtype in PRECISIONS.items():
        points = []
        for m in (2, 3, 4):
            phase, weight = oracles.random_returns(rng, returns=m, pixels=150)
            found = tm.pisarenko(oracles.moments_of_returns(phase, weight, m).astype(dtype))
            for k in np.flatnonzero(found.count == m):
                condition, _ = exact.conditions(
                    tuple(map(mp.mpf, phase[:, k])), tuple(map(mp.mpf, weight[:, k])), m
                )
                error = oracles.around(found.phase_rad[:, k] - phase[:, k]).max()
                points.append((max(condition), max(float(error), 1e-17)))
        x, y = np.array(points).T
        axis.loglog(x, y, ".", color=COLOURS[precision], label=precision, ms=4)
        line = np.geomspace(x.min(), x.max(), 2)
        axis.loglog(line, np.finfo(dtype).eps * line, color=COLOURS[precision], lw=0.8)
    axis.set_xlabel("condition of the phases")
    axis.set_ylabel("phase error / rad")
    axis.legend(title="line: condition times eps")
    axis.grid(alpha=0.3)
    path.write_bytes(saved(figure, "png"))


def plot_order(path: Path) -> None:
    """Draw backward errors against m, for returns at about equal distances."""
    figure = blank(6, 4.5)
    axis = figure.subplots()
    styles = {"reflection coefficients": "o-", "polynomial": "s--", "returns": "^:"}
    orders = np.unique(np.geomspace(1, 32, 14).astype(int))
    for precision, dtype in PRECISIONS.items():
        curves: dict[str, list[float]] = {name: [] for name in styles}
        for m in orders.tolist():
            phase = 2 * np.pi * (np.arange(m) + 0.3) / m + 0.1 * np.sin(np.arange(m)) / m
            weight = 1 + 0.5 * np.cos(np.arange(m))
            b = oracles.moments_of_returns(phase, weight, m)
            signal = Signal("", tuple(map(mp.mpf, phase)), tuple(map(mp.mpf, weight)))
            lit = Signal("", signal.phase, signal.weight, mp.mpf(0.01) * mp.mpf(float(b[0].real)))
            dense = dict(dense_errors(lit, m, dtype))
            for name in ("reflection coefficients", "polynomial"):
                curves[name].append(max(dense[f"{name}, backward"], 1e-17))
            found = tm.pisarenko(b.astype(dtype))
            again = oracles.moments_of_returns(np.nan_to_num(found.phase_rad), found.weight, m)
            again[0] += found.uniform
            curves["returns"].append(float(np.abs(again - b.astype(dtype)).max() / b[0].real))
        for name, values in curves.items():
            label = f"{name}, {precision}"
            axis.loglog(orders, values, styles[name], color=COLOURS[precision], label=label, ms=4)
    axis.set_xlabel("m")
    axis.set_ylabel("backward error")
    axis.legend(fontsize=8)
    axis.grid(alpha=0.3)
    path.write_bytes(saved(figure, "png"))


FIGURES = {
    "separation": (plot_separation, "Error against the separation of two returns."),
    "condition": (plot_condition, "Error against the condition number of random sparse signals."),
    "order": (plot_order, "Backward errors against m (uniform share 1 % for the density)."),
}


def tables(figures: Path) -> Iterator[Table]:
    """Hold everything against closed forms and 60-digit arithmetic, for about a minute."""
    yield targets()
    yield fates()
    for name, (plot, caption) in FIGURES.items():
        plot(figures / f"stability-{name}.png")
        picture = f"![{caption}](../figures/stability-{name}.png)"
        yield Table("", text=[picture, caption])
    yield helped()
    yield case_table("Sparse signals, worst over all m", sparse_signals, sparse_errors)
    yield case_table("Dense signals, worst over all m", dense_signals, dense_errors)
