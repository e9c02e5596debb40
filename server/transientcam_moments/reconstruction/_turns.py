"""Which turn of the base frequency's phase a range is in, by the phase at a low frequency."""

from typing import Final, NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, namespace
from transientcam_moments.images import gaussian_taps, smooth
from transientcam_moments.likelihood import SIGNIFICANCE, ambiguous
from transientcam_moments.moment_problem import Returns
from transientcam_moments.reconstruction._settings import Settings

_TURN: Final = 2 * np.pi
_UNMODELLED_RAD: Final = 0.5
"""Of the base frequency: what calibration, and returns that are not found, leave of the phase."""
_NOISY_RAD: Final = 0.7
"""Noise from which on a pixel is averaged over more neighbours."""
_WIDE_PX: Final = 2.0
"""Of that Gaussian."""
_BEFORE: Final = 1 / 16
"""Of a turn of the low frequency, by which noise may put light before the camera."""


class LowFrequency(NamedTuple):
    """What was measured at the low frequency of b_0.

    Attributes
    ----------
    phasor : array, shape (...)
        Sum of all light, without the phase of the gain, not smoothed.
    ratio : float
        The low frequency over the base frequency.
    """

    phasor: Array
    ratio: float


def low_phase_rad(settings: Settings, calibration: Array) -> float | None:
    """Return the phase of the gain at the low frequency; None where it does not follow.

    That of the settings, or else what sub-phases, the same at all frequencies, and one delay that
    is shorter than half a period of the base frequency give it, by the gains of b_1 and b_2. Gains
    for all pixels alike with m = 1 are taken to have no delay.
    """
    low_hz, base_hz = settings.low_frequency_hz, settings.base_frequency_hz
    if settings.zeroth != "low-frequency" or low_hz is None or base_hz is None:
        return None
    if low_hz >= base_hz:
        return None
    if settings.low_phase_rad is not None or not settings.consecutive:
        return settings.low_phase_rad
    gain = np.asarray(calibration)
    if len(gain) < 3:
        return float(np.angle(gain[1])) if gain.ndim == 1 else None
    with np.errstate(all="ignore"):
        first, second = (np.nansum(each / abs(each)) for each in gain[1:3])
    delay_rad = np.angle(second * np.conj(first))
    return float(np.angle(first) - delay_rad * (1 - low_hz / base_hz))


def turns(
    low: LowFrequency, phase: Array, returns: Returns, std_rad: Array | float, sigma_px: float
) -> tuple[Array, Array]:
    """Return how many whole turns come before a phase, and where that stays open.

    Parameters
    ----------
    low
        Of the pixels (...).
    phase : array, shape (...)
        Of the direct return at the base frequency.
    returns : Returns
        All light that was found: the low frequency sees its sum.
    std_rad : array, shape (...)
        Standard deviation of the phase at the low frequency before smoothing.
    sigma_px : float
        Of the Gaussian that it is smoothed with; noisy pixels take `_WIDE_PX`.

    Returns
    -------
    tuple of arrays, shape (...)
        Turns >= 0, and where another number of them explains the phase nearly as well: by noise, or
        as light of several turns is mixed.
    """
    xp = namespace(phase)
    picture = low.phasor.ndim == 2
    phasor, square = low.phasor, (std_rad / low.ratio) ** 2
    if picture and sigma_px > 0:
        noisy = square * _left(sigma_px) > _NOISY_RAD**2
        near, wide = (smooth(low.phasor[None], px)[0] for px in (sigma_px, _WIDE_PX))
        phasor = xp.where(noisy, wide, near)
        square = square * xp.where(noisy, _left(_WIDE_PX), _left(sigma_px))
    # later light within one turn behind the direct return, what is just before it, before it
    behind = xp.remainder(xp.nan_to_num(returns.phase_rad - phase) + 1.0, _TURN) - 1.0
    light = xp.where(returns.weight > 0, returns.weight, 0.0)
    seen = (light * xp.exp(1j * low.ratio * behind)).sum(axis=0)
    seen = xp.where(light.sum(axis=0) > 0, seen, 1.0) * xp.exp(1j * low.ratio * phase)
    apart = phasor * xp.conj(seen)
    passed = xp.arctan2(apart.imag, apart.real) / _TURN
    passed = (xp.remainder(passed + _BEFORE, 1.0) - _BEFORE) / low.ratio
    whole = xp.round(passed)
    lead = 2 * _TURN * (np.pi - _TURN * abs(passed - whole)) / (square + _UNMODELLED_RAD**2)
    return xp.maximum(whole, 0.0), ambiguous(lead, SIGNIFICANCE)


def _left(sigma_px: float) -> float:
    """Return the share of the variance that smoothing leaves where all pixels are alike."""
    return float((gaussian_taps(sigma_px) ** 2).sum()) ** 2
