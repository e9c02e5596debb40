"""Sharp returns against the Cramer-Rao bound, and single returns that noise splits."""

from collections.abc import Iterator
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.tables import Table, heads
from benchmarks.likelihood.errors import COLUMNS, Array, ranges, turn_m

BASE_HZ: Final = 23e6
NOISE_SHARE: Final = 1 / 200
"""Standard deviation of each part of a moment, over b_0: a single take, smoothed."""
CASES: Final = ((1, 3), (1, 4), (2, 4), (2, 6), (3, 4), (3, 6), (3, 8))
PIXELS: Final = 4000
SPLIT_PIXELS: Final = 100_000
APART: Final = 4.4
"""Over m: distance of neighbouring returns in radians; closer ones cannot be resolved."""
SEED: Final = 1
_NUMBERS: Final = [f"{each}:.2f" for each in ("bound", *COLUMNS, "likelihood over bound")]


def tables() -> Iterator[Table]:
    """Measure RMSE against the bound, and false splits."""
    yield _bound()
    yield _splits()


def scene(returns: int, m: int, random: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return moments (m + 1, P), phases and weights (K, P), of light 1 in all."""
    apart = APART / m + random.uniform(0, 0.5, (returns, PIXELS))
    phase = np.cumsum(apart, axis=0) + random.uniform(0, 0.3, PIXELS)
    weight = random.uniform(0.4, 1.0, (returns, PIXELS))
    weight = weight / weight.sum(axis=0)
    j = np.arange(m + 1)[:, None, None]
    b = (weight * np.exp(1j * j * phase)).sum(axis=1)
    return b, phase, weight


def _bound() -> Table:
    random = np.random.default_rng(SEED)
    table = Table(
        "Sharp returns: RMSE of the first one's range, and the Cramer-Rao bound, mm",
        heads(" | ".join(["returns, m", *_NUMBERS])),
        notes=[
            f"{PIXELS} random responses each: returns at least {APART:g}/m radians apart, of 0.4 "
            "to 1.0 before they are made 1 in all; f = 23 MHz; every part of a moment has a "
            f"standard deviation of 1/{1 / NOISE_SHARE:.0f} of b_0. The bound is that without "
            "b_0, its root mean square over the responses.",
        ],
    )
    settings = tm.Settings(base_frequency_hz=BASE_HZ, estimator="pisarenko")
    for returns, m in CASES:
        b, phase, weight = scene(returns, m, random)
        noise = tm.noise.MomentNoise(np.full(b.shape, NOISE_SHARE**2))
        measured = tm.noise.draw(b, noise, random, draws=1)[:, 0]
        bound = tm.noise.cramer_rao(phase, weight, noise).phase_std_rad[0]
        bound_mm = 1e3 * float(tm.range_m(np.sqrt(np.mean(bound**2)), BASE_HZ))
        truth = np.asarray(tm.range_m(phase[0], BASE_HZ))
        rmse = {}
        for name, found in ranges(measured, settings, noise=noise).items():
            off = np.remainder(found - truth + turn_m(BASE_HZ) / 2, turn_m(BASE_HZ))
            rmse[name] = 1e3 * float(np.sqrt(np.nanmean((off - turn_m(BASE_HZ) / 2) ** 2)))
        table.rows.append(
            (
                f"{returns}, {m}",
                bound_mm,
                *rmse.values(),
                rmse["likelihood"] / bound_mm,
            )
        )
    return table


def _splits() -> Table:
    random = np.random.default_rng(SEED)
    table = Table(
        "Single returns that are taken for something else",
        heads(
            "m | b_0 | as two or three:.3% | as one with a tail:.3% | explained:.2% | "
            "reduced chi-square:.3f"
        ),
        notes=[
            f"{SPLIT_PIXELS} pixels each; explained: chi-square below what noise exceeds in one "
            "pixel of a thousand."
        ],
    )
    for m in (2, 3, 4, 6, 8):
        for zeroth in (True, False):
            b = np.exp(1j * np.arange(m + 1)[:, None] * random.uniform(0.2, 6, SPLIT_PIXELS))
            variance = np.full(b.shape, NOISE_SHARE**2)
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
