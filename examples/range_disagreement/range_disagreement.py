"""The product ``range-disagreement``: how far the ranges of single frequencies lie apart."""

import numpy as np

from transientcam_moments.plugins import MapProduct

METRES_A_TURN_HZ = 299_792_458.0 / 2


def range_disagreement(b, *, noise=None, frequencies_hz):
    """Return the largest distance in m to the range of the lowest frequency, of moments b."""
    period_m = METRES_A_TURN_HZ / frequencies_hz[1:].reshape(-1, *[1] * (b.ndim - 1))
    range_m = np.angle(b[1:]) / (2 * np.pi) * period_m
    apart_m = range_m - range_m[0]
    apart_m -= period_m * np.rint(apart_m / period_m)  # each is known up to whole turns
    return np.where(np.abs(b[1:]).min(axis=0) > 0, np.abs(apart_m).max(axis=0), np.nan)


PRODUCT = MapProduct(
    name="range-disagreement", unit="m", summary="how far ranges of single frequencies lie apart",
    least_harmonics=2, assumptions="One sharp return makes it 0.", cost="An angle a frequency.",
    failure="Noise makes it larger, too.", compute=range_disagreement,
)  # fmt: skip
