"""What estimators make of two returns at the frequencies of a camera, on the same noisy moments."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.tables import Column, Table

SEPARATIONS_M: Final = (1.2, 2.4, 5.0)
FIRST_M: Final = 2.0
RATIO: Final = 0.5
"""Of the second return's weight to the first one's."""
NOISE: Final = 0.01
"""Standard deviation of each real part of a moment, over b_0."""
_PIXELS: Final = 4000


@dataclass(frozen=True)
class Measured:
    """Which multiples of a base frequency are measured, beside b_0."""

    name: str
    base_hz: float
    multiples: tuple[int, ...]

    @property
    def consecutive(self) -> bool:
        """Whether Pisarenko's estimate can be made."""
        return self.multiples[-1] == len(self.multiples)

    @property
    def radian_m(self) -> float:
        """Range of a radian of the base frequency."""
        return float(tm.range_m(np.float64(1.0), self.base_hz))


SETS: Final = (
    Measured("7 MHz x 1, 2, 3, 4", 7e6, (1, 2, 3, 4)),
    Measured("7 MHz x 1, 3, 4", 7e6, (1, 3, 4)),
    Measured("7 MHz x 2, 3", 7e6, (2, 3)),
    Measured("8 MHz x 2, 10, 15", 8e6, (2, 10, 15)),
)


def table() -> Table:
    """Measure the deviation of the nearer return's distance, as a median over noisy pixels."""
    apart = [Column(f"{each:g} m apart, mm", ".0f") for each in SEPARATIONS_M]
    made = Table("Median error of the nearer return's distance", ["frequencies, estimator", *apart])
    estimators: dict[str, Callable[[Measured, float], float | None]] = {
        "Cramer-Rao bound": _bound_m,
        "least squares of two returns": lambda *case: _error_m(_least_squares_rad, *case),
        "Pisarenko": lambda *case: _error_m(_pisarenko_rad, *case),
        "single frequency": lambda *case: _error_m(_single_rad, *case),
    }
    for measured in SETS:
        for name, estimate in estimators.items():
            found = [estimate(measured, each) for each in SEPARATIONS_M]
            if None not in found:
                errors_mm = (1e3 * (each or 0.0) for each in found)
                made.rows.append((f"{measured.name}: {name}", *errors_mm))
    return made


def _returns(measured: Measured, separation_m: float) -> tuple[NDArray[Any], NDArray[Any]]:
    phase_rad = np.array([FIRST_M, FIRST_M + separation_m]) / measured.radian_m
    return phase_rad, np.array([1.0, RATIO])


def _noisy(measured: Measured, separation_m: float) -> NDArray[np.complex128]:
    """Return moments (K + 1, P) of b_0 and each multiple; the same noise for every estimator."""
    phase_rad, weight = _returns(measured, separation_m)
    j = np.array((0, *measured.multiples))
    b = (weight * np.exp(1j * np.outer(j, phase_rad))).sum(axis=1)
    noise = np.random.default_rng(20).normal(0, NOISE * weight.sum(), (2, len(j), _PIXELS))
    found: NDArray[np.complex128] = b[:, None] + noise[0] + 1j * noise[1] * (j > 0)[:, None]
    return found


def _error_m(
    estimate: Callable[[Measured, NDArray[Any]], NDArray[Any] | None],
    measured: Measured,
    separation_m: float,
) -> float | None:
    found_rad = estimate(measured, _noisy(measured, separation_m))
    if found_rad is None:
        return None
    return float(np.nanmedian(np.abs(found_rad * measured.radian_m - FIRST_M)))


def _least_squares_rad(measured: Measured, b: NDArray[Any]) -> NDArray[Any]:
    variance = np.full(len(measured.multiples), (NOISE * (1 + RATIO)) ** 2)
    found = tm.likelihood(
        b[1:],
        tm.noise.MomentNoise(variance),
        harmonics=measured.multiples,
        returns=2,
        tail_shape=0,
        threads=1,
    )
    return np.asarray(found.separate().phase_rad)


def _pisarenko_rad(measured: Measured, b: NDArray[Any]) -> NDArray[Any] | None:
    if not measured.consecutive:
        return None
    return np.asarray(tm.separate(tm.pisarenko(tm.bias(b).moments)).phase_rad)


def _single_rad(measured: Measured, b: NDArray[Any]) -> NDArray[Any] | None:
    if measured.multiples[0] != 1:  # its period is too short for the range
        return None
    return np.asarray(np.mod(np.angle(b[1]), 2 * np.pi))


def first_return_std_m(measured: Measured, separation_m: float) -> float:
    """Return the least standard deviation of the nearer return's distance, in m."""
    phase_rad, weight = _returns(measured, separation_m)
    variance = np.full(measured.multiples[-1] + 1, np.inf)  # of what is not measured
    variance[list(measured.multiples)] = (NOISE * weight.sum()) ** 2
    bound = tm.noise.cramer_rao(phase_rad, weight, tm.noise.MomentNoise(variance))
    return float(bound.phase_std_rad[0] * measured.radian_m)


def _bound_m(measured: Measured, separation_m: float) -> float:
    return 0.674490 * first_return_std_m(measured, separation_m)
