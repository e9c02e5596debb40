"""How well a calibration still does: the share of pixels whose moments contradict each other."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm

_Array = NDArray[Any]
DEVIATIONS: Final = 4.0
"""What noise explains: so many of its standard deviations."""


def invalid_share(found: tm.Reconstruction, noise: tm.noise.MomentNoise) -> float | None:
    """Return the share of a frame's pixels whose moments are invalid, and not by noise alone.

    Moments of light have a Toeplitz matrix without negative eigenvalues (Proposition 1). Where the
    smallest one is negative by more than noise explains, gain or phase of the frequencies do not
    go together any more, as they do after calibration: thermal drift (Sec. 6.4).

    Parameters
    ----------
    found
        Of the frame, (m + 1, H, W).
    noise
        Of its smoothed moments.

    Returns
    -------
    share
        Among the pixels with light; None where there are none.
    """
    lit = np.asarray(found.flags) & (tm.Flags.NO_SIGNAL | tm.Flags.NON_FINITE) == 0
    lit &= np.asarray(found.flags) & tm.Flags.SATURATED == 0
    if not lit.any():
        return None
    eigenvalue = np.asarray(found.validity) * np.asarray(found.smoothed[0].real)
    variance = np.asarray(noise.variance)
    # noise moves no eigenvalue by more than the norm of its own Toeplitz matrix
    std = np.sqrt(len(variance) * variance.mean(axis=0))
    return float((eigenvalue < -DEVIATIONS * std)[lit].mean())


JUDGED_PIXELS: Final = 512
"""Pixels of each frame whose deviation is predicted."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Predicted deviation of a frame's range.

    Attributes
    ----------
    median_m, p90_m
        Half of the pixels, and 90 % of them, are better.
    first_order_share
        Share of the pixels where first order holds; that of the others is by the order of
        magnitude.
    """

    median_m: float
    p90_m: float
    first_order_share: float

    def to_document(self) -> dict[str, float]:
        """Return it as a frame's metadata have it."""
        return {
            "median": self.median_m,
            "p90": self.p90_m,
            "first_order_share": self.first_order_share,
        }


MEDIAN_OF_NORMAL: Final = 0.674490
"""Median of the absolute value of a standard normal variable."""
