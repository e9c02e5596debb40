"""Which pair of returns estimators find at frequencies with gaps, and which fit better."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.tables import Table
from transientcam_moments.likelihood._estimate import dense, prepared
from transientcam_moments.likelihood._planar import SharpFit

MULTIPLES: Final = (2, 10, 15)
BASE_HZ: Final = 8e6
FIRST_M: Final = (0.5, 5.0)
SEPARATIONS_M: Final = ((0.3, 3.0), (3.0, 8.0))
RATIOS: Final = (0.2, 1.0)
"""Of the second return's weight to the first one's, which is 1."""
NOISES: Final = (0.0, 0.003, 0.01)
"""Standard deviation of each real part of a moment, over all light."""
LEAST_NOISE: Final = 1e-3
"""That estimators are given where there is none."""
WRONG_M: Final = 0.3
"""A nearer return that is further off belongs to another pair."""
_PIXELS: Final = 4000
_STEPS: Final = 30
_RADIAN_M: Final = float(tm.range_m(np.float64(1.0), BASE_HZ))


@dataclass(frozen=True)
class Pixels:
    """Noisy moments (3, P) of random pairs of returns."""

    range_m: NDArray[Any]
    """Of the nearer and the further return (2, P)."""
    b: NDArray[Any]
    noise: tm.noise.MomentNoise
    """``b``, ``noise``: moments and the noise that is stated to estimators."""

    def off_m(self, found: tm.Likelihood) -> NDArray[Any]:
        """Return how far the nearer return is off (P)."""
        period_m = 2 * np.pi * _RADIAN_M
        off_m = np.asarray(found.separate().phase_rad) * _RADIAN_M - self.range_m[0]
        return np.asarray(np.abs((off_m + period_m / 2) % period_m - period_m / 2))

    def least_chi_square(self) -> NDArray[Any]:
        """Return chi-square (P) of the true pair, once it has been fitted to the noise."""
        planes, variance = dense(self.b, self.noise, MULTIPLES, self.b.shape[1:])
        data, _, _ = prepared(planes, variance, 0.0)
        phase_rad = self.range_m / _RADIAN_M
        fit = SharpFit.at(data, list(np.cos(phase_rad)), list(np.sin(phase_rad)))
        fit.improve(_STEPS, np.inf + 0 * data.penalty)
        return np.asarray(fit.cost)


def random_pixels(apart_m: tuple[float, float] | None, noise: float) -> Pixels:
    """Draw pairs so far apart, or single returns, and the noise of their moments."""
    rng = np.random.default_rng(20)
    first_m = rng.uniform(*FIRST_M, _PIXELS)
    second_m = first_m + rng.uniform(*(apart_m or (0.0, 0.0)), _PIXELS)
    ratio = rng.uniform(*RATIOS, _PIXELS) if apart_m else np.zeros(_PIXELS)
    j = np.array(MULTIPLES)[:, None]
    b = np.exp(1j * j * first_m / _RADIAN_M) + ratio * np.exp(1j * j * second_m / _RADIAN_M)
    light = 1 + ratio
    drawn = rng.normal(size=(2, *b.shape)) * (noise * light)
    variance = np.broadcast_to((max(noise, LEAST_NOISE) * light) ** 2, b.shape)
    return Pixels(
        np.stack([first_m, second_m]), b + drawn[0] + 1j * drawn[1], tm.noise.MomentNoise(variance)
    )


def table() -> Table:
    """Compare the estimators on the same pixels."""
    flags = ("of these flagged", "others flagged")
    shares = ("1 cm", "5 cm", "split", "another pair", "that fits better", *flags)
    columns = ("returns", "noise", "estimator", *shares)
    made = Table("Two returns at 16, 80 and 120 MHz: shares of the pixels", columns)
    estimators: dict[str, Callable[[Pixels], tm.Likelihood]] = {
        "`two-returns`": lambda each: tm.two_returns(each.b, each.noise, harmonics=MULTIPLES),
        "`likelihood`": lambda each: tm.likelihood(
            each.b, each.noise, harmonics=MULTIPLES, threads=1
        ),
        "`likelihood`, two returns": lambda each: tm.likelihood(
            each.b, each.noise, harmonics=MULTIPLES, returns=2, tail_shape=0, threads=1
        ),
    }
    for apart_m in (None, *SEPARATIONS_M):
        for noise in NOISES:
            pixels = random_pixels(apart_m, noise)
            returns = "one" if apart_m is None else f"{apart_m[0]:g} to {apart_m[1]:g} m apart"
            for name, estimate in estimators.items():
                row = _shares(pixels, estimate(pixels))
                shown = ("" if np.isnan(share) else f"{share:.1%}" for share in row)
                made.rows.append((returns, f"{noise:.1%}", name, *shown))
    return made


def _shares(pixels: Pixels, found: tm.Likelihood) -> tuple[float, ...]:
    off_m = pixels.off_m(found)
    wrong = ~(off_m <= WRONG_M)
    simple = (found.count <= 2) & ~found.has_tail
    split = (pixels.range_m[0] == pixels.range_m[1]) & ~((found.count == 1) & simple)
    better = wrong & simple & (found.chi_square <= pixels.least_chi_square())
    flagged = np.asarray(found.ambiguous())
    groups = (off_m < 0.01, off_m < 0.05, split, wrong, better, flagged[wrong], flagged[~wrong])
    return tuple(float(np.mean(each)) if each.size else float("nan") for each in groups)
