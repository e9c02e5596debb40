"""The inverse Fourier transform of what was measured, all else taken as zero, and corrected."""

import numpy as np

from transientcam_moments.arrays import Array, chosen
from transientcam_moments.comparisons._estimate import GRID_PHASES, GridEstimate, Real, grid_rad
from transientcam_moments.comparisons._pixels import pixels_of
from transientcam_moments.comparisons._technique import TEXTS, Technique, from_first

WINDOWS = ("hann", "none")
CORRECTIONS = ("lift", "clip", "none")


def inverse_fourier(
    b: Array, *, window: str = "hann", correction: str = "lift", bins: int = GRID_PHASES
) -> GridEstimate:
    """Estimate a density as the Fourier series of the moments.

    Parameters
    ----------
    window : {"hann", "none"}
        What the harmonics are weighted with against ringing.
    correction : {"lift", "clip", "none"}
        What becomes of negative densities. "lift" does not look at b_0 and takes the least one
        that leaves none; "clip" makes them 0 and scales the rest to b_0; "none" leaves them.
    bins : int
        Of phase, more than 2 m.

    Notes
    -----
    h = [b_0 + 2 Re sum_j w_j b_j exp(-i j phi)] / (2 pi). Without window and correction it has
    exactly the moments of the measurement, and no others.
    """
    chosen("window", window, WINDOWS)
    chosen("correction", correction, CORRECTIONS)
    pixels = pixels_of(b, least=1, name="inverse-fourier", first=int(correction == "lift"))
    m = pixels.m
    pixels.require_bins(bins)
    orders = np.arange(1, m + 1)
    weights = 0.5 + 0.5 * np.cos(np.pi * orders / (m + 1)) if window == "hann" else 1.0 + 0 * orders
    angles = grid_rad(bins)[:, None] * orders
    parts = np.concatenate([pixels.b[1:].real, pixels.b[1:].imag])
    waves = np.concatenate([weights * np.cos(angles), weights * np.sin(angles)], axis=1)
    series = (waves @ parts) / np.pi
    return pixels.grid(_corrected(series, pixels.b[0].real / (2 * np.pi), correction))


def _corrected(series: Real, mean: Real, correction: str) -> Real:
    if correction == "lift":
        lifted: Real = series - series.min(axis=0)
        return lifted
    density: Real = series + mean
    if correction == "none":
        return density
    positive = np.maximum(density, 0)
    total = positive.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        clipped: Real = positive * np.where(total > 0, np.maximum(mean, 0) / total, 0)
    return clipped


TECHNIQUE = Technique(
    **TEXTS["inverse-fourier"], harmonics=from_first, least_harmonics=1, estimate=inverse_fourier
)
