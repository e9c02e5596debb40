"""Where a turn of the base frequency's phase begins, and which one a range is in."""

import math
from typing import Final, NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, namespace, some
from transientcam_moments.images import gaussian_taps, smooth
from transientcam_moments.likelihood import SIGNIFICANCE, ambiguous
from transientcam_moments.moment_problem import Separation
from transientcam_moments.reconstruction._settings import Settings

_TURN: Final = 2 * np.pi
_UNMODELLED_RAD: Final = 0.5
"""Of the base frequency: what calibration, and returns that are not found, leave of the phase."""
_DOUBTFUL_RAD: Final = 1.0
"""By which returns have to predict another phase before they may come in another order."""
_NOISY_RAD: Final = 0.7
"""Noise from which on a pixel is averaged over more neighbours."""
_WIDE_PX: Final = 3.0
"""Of that Gaussian."""
_BEFORE: Final = 1 / 16
"""Of a turn of the low frequency, by which noise may put light before the camera."""


def begun(phase: Array, start_rad: float, turn_rad: float = _TURN) -> Array:
    """Return phases in [0, turn) in the turn that begins at a phase; the rest as they are."""
    xp = namespace(phase)
    whole = math.floor(start_rad / turn_rad) * turn_rad
    found = xp.where(phase < start_rad - whole, phase + (whole + turn_rad), phase + whole)
    return found.astype(phase.dtype)


def beginning_at(
    start_rad: float, found: Separation, phase: Array, weight: Array, threshold: float
) -> Separation:
    """Return direct and indirect light where the turn begins at a phase, and so does its phase.

    Parameters
    ----------
    start_rad
        Of the base frequency.
    found : Separation
        Of a turn from 0 on: kept wherever the first return is the same.
    phase, weight : array, shape (K, ...)
        Of all returns, the phase in [0, 2 pi).
    threshold
        As of `separate`, for returns that come first only as the turn begins there.
    """
    xp = namespace(found.phase_rad)
    seam = start_rad % _TURN
    direct, indirect, first = found.direct, found.indirect, begun(found.phase_rad, start_rad)
    early = (phase >= seam) & (weight >= threshold * weight.max(axis=0)) & (weight > 0)
    other = early.any(axis=0) & (found.phase_rad < seam)
    if not some(other):
        return Separation(direct, indirect, first)
    order = xp.argmin(xp.where(early, phase, np.inf), axis=0)[None]
    light, at = (xp.take_along_axis(part, order, axis=0)[0] for part in (weight, phase))
    return Separation(
        xp.where(other, light, direct),
        xp.where(other, direct + indirect - light, indirect),
        xp.where(other, begun(at, start_rad), first),
    )


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
    is shorter than half a period of the base frequency give it, by the gains of b_1 and b_2. With
    m = 1 a gain without phase, or with a quarter of a turn as of arccos sampling, has no delay.
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
        if gain.ndim > 1 or abs(gain[1].real * gain[1].imag) > 1e-9 * abs(gain[1]) ** 2:
            return None
        return float(np.angle(gain[1]))
    with np.errstate(all="ignore"):
        first, second = (np.nansum(each / abs(each)) for each in gain[1:3])
    delay_rad = np.angle(second * np.conj(first))
    return float(np.angle(first) - delay_rad * (1 - low_hz / base_hz))


class Turned(NamedTuple):
    """Direct light with the whole turns before it, and what of it stays open.

    Attributes
    ----------
    phase_rad, direct, indirect : array, shape (...)
        As of `Separation`, the phase from the least range on without end.
    open : boolean array, shape (...)
        Where another number of turns explains the low frequency nearly as well: by noise, or as
        light of several turns is mixed.
    """

    phase_rad: Array
    direct: Array
    indirect: Array
    open: Array


def turned(
    low: LowFrequency,
    found: Separation,
    phase: Array,
    weight: Array,
    std_rad: Array | float,
    sigma_px: float,
    threshold: float,
) -> Turned:
    """Put direct light in its turn.

    Parameters
    ----------
    low
        Of the pixels (...).
    found : Separation
        Its phase within one turn.
    phase, weight : array, shape (K, ...)
        All light that was found, of which the low frequency sees the sum.
    std_rad : array, shape (...)
        Standard deviation of the phase at the low frequency before smoothing.
    sigma_px : float
        Of the Gaussian that it is smoothed with; noisy pixels take `_WIDE_PX`.
    threshold : float
        As of `separate`.

    Notes
    -----
    Light that is said to come first may be later light of the next turn. Where the phase at the low
    frequency is far from what the order of the returns predicts, that order is taken, beginning
    with another one of them, which predicts it best.
    """
    xp = namespace(found.phase_rad)
    picture = low.phasor.ndim == 2
    phasor, square = low.phasor, (std_rad / low.ratio) ** 2
    if picture and sigma_px > 0:
        noisy = square * _left(sigma_px) > _NOISY_RAD**2
        near, wide = (smooth(low.phasor[None], px)[0] for px in (sigma_px, _WIDE_PX))
        phasor = xp.where(noisy, wide, near)
        square = square * xp.where(noisy, _left(_WIDE_PX), _left(sigma_px))
    weight = xp.where(weight > 0, weight, 0.0)
    phase = xp.where(weight > 0, phase, 0.0)
    passed = _passed(low.ratio, phasor, found.phase_rad, phase, weight)
    first, direct, indirect = found.phase_rad, found.direct, found.indirect
    if xp is np:
        enough = (weight >= threshold * weight.max(axis=0)) & (weight > 0)
        doubtful = (_rest(passed) > _DOUBTFUL_RAD) & (enough.sum(axis=0) > 1)
        if doubtful.any():
            planes = [np.array(each) for each in (first, direct, indirect, passed)]
            of_them = phase[:, doubtful], weight[:, doubtful]
            best = [each[doubtful] for each in planes]
            for k, (other, light) in enumerate(zip(*of_them, strict=True)):
                tried = _passed(low.ratio, phasor[doubtful], other, *of_them)
                better = enough[k, doubtful] & (_rest(tried) < _rest(best[3]) - _DOUBTFUL_RAD / 2)
                new = other, light, best[1] + best[2] - light, tried
                best = [np.where(better, *each) for each in zip(new, best, strict=True)]
            for plane, each in zip(planes, best, strict=True):
                plane[doubtful] = each
            first, direct, indirect, passed = planes
    whole = xp.maximum(xp.round(passed), 0.0)
    off = xp.where(
        whole > 0, abs(passed - whole), passed - whole
    )  # less than 0 turns there are not
    lead = _TURN**2 * (1 - 2 * off) / (square + _UNMODELLED_RAD**2)
    return Turned(first + _TURN * whole, direct, indirect, ambiguous(lead, SIGNIFICANCE))


def _passed(ratio: float, phasor: Array, first: Array, phase: Array, weight: Array) -> Array:
    """Return the turns before the first return (P), not whole, if others (K, P) are behind it."""
    xp = namespace(first)
    # what is just before it, as of another estimate, is before it
    behind = xp.remainder(phase - first + 1.0, _TURN) - 1.0
    seen = (weight * xp.exp(1j * ratio * behind)).sum(axis=0)
    seen = xp.where(weight.sum(axis=0) > 0, seen, 1.0) * xp.exp(1j * ratio * first)
    apart = phasor * xp.conj(seen)
    turn = xp.arctan2(apart.imag, apart.real) / _TURN
    return (xp.remainder(turn + _BEFORE, 1.0) - _BEFORE) / ratio


def _rest(passed: Array) -> Array:
    """Return how far turns are from whole ones, as a phase."""
    return _TURN * abs(passed - namespace(passed).round(passed))


def _left(sigma_px: float) -> float:
    """Return the share of the variance that smoothing leaves where all pixels are alike."""
    return float((gaussian_taps(sigma_px) ** 2).sum()) ** 2
