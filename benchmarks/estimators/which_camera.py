"""What a camera's frequencies are good for: range, corners, two returns, and light in flight.

All cameras get the same light and the same time of exposure, which each divides among its
frequencies: a camera of n frequencies has noise of `NOISE` sqrt(n / 3). Noise has a known seed, so
that no figure depends on the machine.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.tables import Table, heads
from benchmarks.estimators.camera_estimates import NOISE, RATIO, Measured
from transientcam_moments.reconstruction import automatic

CORNER_M, APART_M = (0.1, 0.6), (0.6, 2.4)
FAR_M: Final = 5.0
WRONG_M: Final = 0.5
_PIXELS: Final = 2000
_Array = NDArray[Any]


@dataclass(frozen=True)
class Frequencies(Measured):
    """What a camera measures, and what it tells; `NOISE` is that of three frequencies."""

    @property
    def period_m(self) -> float:
        """Unambiguous range of one return."""
        return 2 * np.pi * self.radian_m

    def range_m(self, returns_m: _Array, weights: tuple[float, ...]) -> _Array:
        """Return the range (P) of the first of some returns (K, P), by its automatic estimator."""
        j = np.array(self.multiples)[:, None, None]
        light = np.array(weights)[:, None]
        b = (light * np.exp(1j * j * returns_m / self.radian_m)).sum(axis=1)
        sigma = NOISE * np.sqrt(len(self.multiples) / 3) * sum(weights)
        drawn = np.random.default_rng(7).normal(size=(2, *b.shape)) * sigma
        b = b + drawn[0] + 1j * drawn[1]
        if len(self.multiples) == 1:
            return np.asarray(np.remainder(np.angle(b[0]), 2 * np.pi)) * self.radian_m
        noise = tm.noise.MomentNoise(np.full(b.shape, sigma**2))
        name = automatic(self.multiples)
        if name == "likelihood":
            found = tm.likelihood(b, noise, harmonics=self.multiples, threads=1).separate()
        elif name == "two-returns":
            found = tm.two_returns(b, noise, harmonics=self.multiples).separate()
        else:
            found = tm.unwrap(b, noise, harmonics=self.multiples).separate()
        return np.asarray(found.phase_rad) * self.radian_m

    def errors_m(self, apart_m: tuple[float, float] | None) -> _Array:
        """Return by how much the first range is wrong, at random ranges up to `FAR_M`."""
        rng = np.random.default_rng(20)
        reach_m = min(FAR_M, 0.8 * self.period_m)
        returns_m = rng.uniform(0.1 * reach_m, reach_m, (1, _PIXELS))
        weights: tuple[float, ...] = (1.0,)
        if apart_m is not None:
            returns_m = np.concatenate([returns_m, returns_m + rng.uniform(*apart_m, _PIXELS)])
            weights = (1.0, RATIO)
        off_m = self.range_m(returns_m, weights) - returns_m[0]
        return np.asarray((off_m + self.period_m / 2) % self.period_m - self.period_m / 2)


CAMERAS: Final = (
    Frequencies("prototype of the paper, 23 MHz x 1..4", 23e6, (1, 2, 3, 4)),
    Frequencies("OPT8241-CDK, 12.5 MHz x 1..8", 12.5e6, tuple(range(1, 9))),
    Frequencies("Kinect v2, 16, 80 and 120 MHz", 8e6, (2, 10, 15)),
    Frequencies("TOFcam660, 7 MHz x 1..4", 7e6, (1, 2, 3, 4)),
    Frequencies("OAK ToF, 80 and 100 MHz", 20e6, (4, 5)),
    Frequencies("a camera of one frequency, 20 MHz", 20e6, (1,)),
)


def table() -> Table:
    """Measure all cameras on the same returns."""
    made = Table(
        "What each can do",
        heads(
            "camera | unambiguous, m:.1f | one return, mm:.1f | wrong turn:.1%"
            " | corner, mm:.0f | two returns 0.6 to 2.4 m apart, mm:.0f | light in flight, ns"
        ),
    )
    for each in CAMERAS:
        one, corner, two = (np.abs(each.errors_m(apart)) for apart in (None, CORNER_M, APART_M))
        width_ns = 1e9 / (each.base_hz * 2 * len(each.multiples))
        made.rows.append(
            (
                each.name,
                each.period_m,
                float(np.nanmedian(one)) * 1e3,
                float(np.mean(~(one < WRONG_M))),
                float(np.nanmedian(corner)) * 1e3,
                float(np.nanmedian(two)) * 1e3,
                f"{width_ns:.1f}" if each.consecutive and len(each.multiples) > 1 else "no",
            )
        )
    made.notes.append(
        "Median errors of the first range, by the estimator that is automatic for these "
        f"frequencies, of {_PIXELS:,} pixels up to {FAR_M:g} m away, or to 80 % of what is "
        "unambiguous; a wrong turn is off by more than "
        f"{WRONG_M:g} m. A corner has a second return half as strong, {CORNER_M[0]:g} to "
        f"{CORNER_M[1]:g} m behind the first, as what bends corners. All cameras have the same "
        "light and time of exposure, which each divides among its frequencies, and noise of "
        f"{NOISE:.0%} of the light at three frequencies: a sensor's own noise is known once "
        "an owner measures it."
    )
    return made


def tables() -> Iterator[Table]:
    """Simulate the frequencies of each camera."""
    yield table()
