"""The estimator ``matched-filter``: the one return that explains the moments of all frequencies."""

import numpy as np

from transientcam_moments.comparisons import SparseEstimate, Technique, from_first

PHASES, STEPS = 128, 4


def matched_filter(b, *, noise=None, frequencies_hz=None):
    """Estimate one return from moments b (m + 1, ...): that of the best correlation."""
    if noise is None:
        precision = np.ones(b[1:].shape)
    else:
        precision = 1 / np.maximum(noise.variance[1:], np.finfo(b.real.dtype).tiny)
    j = np.arange(1, len(b)).reshape(-1, *[1] * (b.ndim - 1))

    def echoes(phase):  # what is left of each moment once a delay is taken back
        return precision * b[1:] * np.exp(-1j * j * phase)

    best, correlation = np.zeros(b.shape[1:]), np.full(b.shape[1:], -np.inf)
    for phase in np.linspace(0, 2 * np.pi, PHASES, endpoint=False):
        found = echoes(phase).real.sum(axis=0)
        better = found > correlation
        best, correlation = np.where(better, phase, best), np.where(better, found, correlation)
    for _ in range(STEPS):  # Newton's: to where the derivative of the correlation is 0
        z = echoes(best)
        slope, bend = (j * z.imag).sum(axis=0), (j**2 * z.real).sum(axis=0)
        best = best + np.where(bend > 0, slope / np.where(bend > 0, bend, 1), 0)
    weight = echoes(best).real.sum(axis=0) / precision.sum(axis=0)
    phase = np.where(weight > 0, np.remainder(best, 2 * np.pi), np.nan)
    return SparseEstimate(phase[None], np.maximum(weight, 0)[None], np.zeros(b.shape[1:]))


ESTIMATOR = Technique(
    name="matched-filter", label="matched filter", returns="1", frequencies="f .. m f",
    harmonics=from_first, least_harmonics=1, assumptions="One sharp return in each pixel.",
    cost="A search over 128 phases and four Newton steps.",
    failure="Other light pulls the range to it.", estimate=matched_filter, informed=True,
)  # fmt: skip
