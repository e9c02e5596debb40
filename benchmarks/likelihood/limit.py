"""How far the range of the likelihood is from the least error, and single returns it splits."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.tables import Table, heads
from benchmarks.likelihood.errors import Array

BASE_HZ: Final = 23e6
PIXELS: Final = 120
SPLIT_PIXELS: Final = 100_000
SPLIT_STD: Final = 1 / 200
ORDERS: Final = (2, 3, 4, 6, 8)
SNRS: Final = (20, 50, 200, 1000, 5000)
"""Of one image: each part of a moment has a standard deviation of b_0 / (sqrt(2) S)."""
RAD_M: Final = float(tm.range_m(np.float64(1.0), BASE_HZ))
DELAYS: Final = (0.3, 0.8)
"""Of tails, in metres, which hold 20 and 50 % of the light."""
SEED: Final = 1
Model = Callable[[Array, int], Array]
NOTE: Final = f"""{PIXELS} random phases in each cell, {PIXELS // 4} for each of the tail's delays \
({" and ".join(map(str, DELAYS))} m) and shares of the light (20 and 50 %). Numbers: root mean \
square error over the limit, the median and the 90 % error over the limit's, and the root mean \
square of error over stated deviation. Limit: least squares with the right number of returns or \
shape of tail, which begins at the truth, on the same moments. Where it doesn't resolve the \
returns, a model with fewer can be below it. No model error."""


def _gamma(shape: int, j: Array, delay: Array) -> Array:
    return np.asarray((1 - 1j * j * delay / shape) ** -shape)


SHAPES: Final[Mapping[str, Callable[[Array, Array], Array]]] = {
    "exponential": partial(_gamma, 1),
    "gamma, p = 2": partial(_gamma, 2),
    "gamma, p = 3": partial(_gamma, 3),
    "box": lambda j, d: np.exp(1j * j * d) * np.sinc(j * d / np.pi),
    "two exponentials": lambda j, d: (2 * _gamma(1, j, d / 2) + _gamma(1, j, 2 * d)) / 3,
    "gap, then exponential": lambda j, d: np.exp(0.6j * j * d) * _gamma(1, j, 0.4 * d),
}


def tables() -> Iterator[Table]:
    """Hold the likelihood to least squares with the right model, for returns and for tails."""
    for measured in (True, False):
        table = _table(f"Sharp returns, b_0 {'measured' if measured else 'not measured'}")
        for m in ORDERS:
            for name, apart, weight in _returns(m):
                if len(weight) <= m:
                    table.rows.append(_row(f"{m}, {name}", m, _sharp, measured, apart, weight))
        yield table
    table = _table("A return with a tail, b_0 measured")
    for m, name in itertools.product((3, 4, 8), SHAPES):
        table.rows.append(_row(f"{m}, {name}", m, partial(_tail, SHAPES[name])))
    table.notes.append(NOTE)
    yield table
    yield _splits()


def _table(title: str) -> Table:
    return Table(title, ("m, light", *(f"S = {snr}: RMS, 50 %, 90 %; z" for snr in SNRS)))


def _returns(m: int) -> Iterator[tuple[str, tuple[float, ...], tuple[float, ...]]]:
    """Yield names, distances from the first return in radians at order m, and weights."""
    yield "one", (), (1.0,)
    for share in (0.6, 1.0, 2.0):
        yield f"two, {share}/m rad, 1 : 1", (share / m,), (0.5, 0.5)
    for length in (0.5, 1.0, 3.0):
        yield f"two, {length} m, 3 : 1", (length / RAD_M,), (0.75, 0.25)
    for first, last in ((0.8, 1.6), (0.4, 2.0)):
        yield f"three, 0, {first}, {last} m", (first / RAD_M, last / RAD_M), (0.6, 0.25, 0.15)


def _sharp(unknowns: Array, m: int) -> Array:
    phase, weight = np.split(unknowns, 2)
    b: Array = (weight * np.exp(1j * np.arange(m + 1)[:, None, None] * phase)).sum(axis=1)
    return b


def _tail(shape: Callable[[Array, Array], Array], unknowns: Array, m: int) -> Array:
    phase, delay, direct, late = unknowns
    j = np.arange(m + 1)[:, None]
    return np.asarray(np.exp(1j * j * phase) * (direct + late * shape(j, np.exp(delay))))


def _row(
    name: str, m: int, model: Model, b_0: bool = True, apart: tuple[float, ...] = (),
    weight: tuple[float, ...] = (),
) -> tuple[str, ...]:  # fmt: skip
    random, cells = np.random.default_rng(SEED), []
    for snr in SNRS:
        phase = random.uniform(0.6, 2.0, PIXELS)
        if weight:
            later = np.add.outer((0.0, *apart), phase)
            truth = np.concatenate([later, np.multiply.outer(weight, np.ones(PIXELS))])
        else:
            delay, late = np.tile([*itertools.product(DELAYS, (0.2, 0.5))], (PIXELS // 4, 1)).T
            truth = np.stack([phase, np.log(delay / RAD_M), 1 - late, late])
        variance = np.full(m + 1, 0.5 / snr**2)
        noise = tm.noise.MomentNoise(np.repeat(variance[:, None], PIXELS, axis=1))
        b = tm.noise.draw(model(truth, m), noise, random, draws=1)[:, 0]
        variance[0] *= b_0
        best = least_squares(b, variance, truth, model)
        first = best[0]
        if weight:
            phases, weights = np.split(best, 2)
            bright = weights >= tm.Settings().threshold * weights.max(axis=0)
            first = np.where(bright, phases, np.inf).min(axis=0)
        found = tm.likelihood(b, tm.noise.MomentNoise(variance))
        off = np.angle(np.exp(1j * (found.separate().phase_rad - phase)))
        limit = np.angle(np.exp(1j * (first - phase)))
        z = off / found.direct_phase_std_rad()
        quantiles = np.quantile(abs(off), (0.5, 0.9)) / np.quantile(abs(limit), (0.5, 0.9))
        ratios = (_rms(off) / _rms(limit), *quantiles)
        cells.append(", ".join(f"{each:.2f}" for each in ratios) + f"; {_rms(z):.2f}")
    return name, *cells


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))


def least_squares(b: Array, variance: Array, unknowns: Array, model: Model) -> Array:
    """Return the unknowns (n, P), the last half of them light, that explain moments best."""
    m, count = len(b) - 1, len(unknowns)
    std = np.sqrt(np.where(variance > 0, variance, np.inf))[:, None]

    def left(unknowns: Array) -> Array:
        rest = (b - model(unknowns, m)) / std
        return np.concatenate([rest.real, rest.imag[1:]])

    def slopes(unknowns: Array) -> Array:
        steps = 1e-6 * np.eye(count)[:, :, None]
        return np.stack([(left(unknowns + s) - left(unknowns - s)) / 2e-6 for s in steps])

    damping, rest = np.full(b.shape[1], 1e-3), left(unknowns)
    for _ in range(60):
        slope = slopes(unknowns)
        matrix = np.einsum("irp,jrp->pij", slope, slope)
        size = damping[:, None] * np.einsum("pii->pi", matrix) + 1e-12
        matrix = matrix + size[:, :, None] * np.eye(count)
        gradient = np.einsum("irp,rp->pi", slope, rest)
        tried = unknowns - np.linalg.solve(matrix, gradient[:, :, None])[:, :, 0].T
        tried[count // 2 :] = np.maximum(tried[count // 2 :], 0)
        new = left(tried)
        better = (new**2).sum(axis=0) < (rest**2).sum(axis=0)
        unknowns, rest = np.where(better, tried, unknowns), np.where(better, new, rest)
        damping = np.clip(damping * np.where(better, 0.2, 6.0), 1e-9, 1e9)
    return unknowns


def _splits() -> Table:
    random = np.random.default_rng(SEED)
    table = Table(
        "Single returns that are taken for something else",
        heads("m | b_0 | two or three:.3% | with a tail:.3% | explained:.2% | chi-square:.3f"),
        notes=[
            f"{SPLIT_PIXELS} pixels each, every part of a moment with a standard deviation of "
            f"1/{1 / SPLIT_STD:.0f} of b_0; explained: chi-square below what noise exceeds in one "
            "pixel of a thousand."
        ],
    )
    for m in (2, 3, 4, 6, 8):
        for zeroth in (True, False):
            b = np.exp(1j * np.arange(m + 1)[:, None] * random.uniform(0.2, 6, SPLIT_PIXELS))
            variance = np.full(b.shape, SPLIT_STD**2)
            noise = tm.noise.MomentNoise(variance)
            measured = tm.noise.draw(b, noise, random, draws=1)[:, 0]
            if not zeroth:
                variance[0] = 0
            found = tm.likelihood(measured, noise)
            table.rows.append(
                (
                    str(m),
                    "measured" if zeroth else "not measured",
                    np.mean(found.count > 1),
                    np.mean(found.has_tail),
                    np.mean(found.explained()),
                    np.nanmean(found.reduced_chi_square),
                )
            )
    return table
