"""Where a turn of the base frequency's phase begins, and which one a range is in."""

import math
from typing import Final

import numpy as np

from transientcam_moments.arrays import Array, namespace, some
from transientcam_moments.images import gaussian_taps, smooth
from transientcam_moments.likelihood import SIGNIFICANCE, ambiguous
from transientcam_moments.moment_problem import Separation
from transientcam_moments.reconstruction._settings import Settings

_TURN: Final = 2 * np.pi
_UNMODELLED_RAD, _DOUBTFUL_RAD, _NOISY_RAD = 0.5, 1.0, 0.7
"""Phase of the base frequency that calibration and light of no return leave; by which the order of
returns may be wrong; and noise from which on a pixel is averaged over `_WIDE_PX`."""
_WIDE_PX: Final = 3.0
_BEFORE: Final = 1 / 16
"""Of a turn of the low frequency, by which noise may put light before the camera."""


def low_phase_rad(settings: Settings, calibration: Array) -> float | None:
    """Return the phase of the gain at the low frequency; None where it does not follow.

    By b_1 and b_2, for sub-phases as at all frequencies and a delay up to half a period from that
    of the settings. With m = 1 a gain of all pixels is known by that one, if the sub-phases' phase
    is 0, or a quarter turn as of arccos.
    """
    if not (settings.zeroth == "low-frequency" and settings.consecutive and settings.low_ratio):
        return None
    gain = np.asarray(calibration)
    step_rad = _TURN * (settings.base_frequency_hz or 0.0) * settings.delay_s
    if len(gain) < 3:
        own = gain[1] * np.exp(-1j * step_rad)
        known = gain.ndim == 1 and abs(own.real * own.imag) <= 1e-9 * abs(own) ** 2
        return float(np.angle(own)) + step_rad * settings.low_ratio if known else None
    with np.errstate(all="ignore"):
        first, second = (np.nansum(each / abs(each)) for each in gain[1:3])
    step_rad += np.angle(second * np.conj(first) * np.exp(-1j * step_rad))
    return float(np.angle(first) - step_rad * (1 - settings.low_ratio))


def begun(phase: Array, start_rad: float, turn_rad: float = _TURN) -> Array:
    """Return phases in [0, turn) in the turn that begins at a phase; the rest as they are."""
    whole = math.floor(start_rad / turn_rad) * turn_rad
    early = phase < start_rad - whole
    return namespace(phase).where(early, phase + (whole + turn_rad), phase + whole)


def beginning_at(
    start_rad: float, found: Separation, phase: Array, weight: Array, threshold: float
) -> Separation:
    """Return light of a turn from 0 on as that of one which begins at a phase.

    Returns (K, ...) that so come first have a share ``threshold`` of the strongest one's light.
    """
    xp, seam = namespace(found.phase_rad), start_rad % _TURN
    early = (phase >= seam) & (weight >= threshold * weight.max(axis=0)) & (weight > 0)
    other = early.any(axis=0) & (found.phase_rad < seam)
    if some(other):
        order = xp.argmin(xp.where(early, phase, np.inf), axis=0)[None]
        light, at = (xp.take_along_axis(part, order, axis=0)[0] for part in (weight, phase))
        rest = found.direct + found.indirect - light
        new = light, rest, at
        found = Separation(*(xp.where(other, *each) for each in zip(new, found, strict=True)))
    return found._replace(phase_rad=begun(found.phase_rad, start_rad))


def turned(
    low: Array, ratio: float, found: Separation, phase: Array, weight: Array,
    std_rad: Array | float, sigma_px: float, threshold: float,
) -> tuple[Separation, Array]:  # fmt: skip
    """Return direct light with the turns before it, >= 0, and where their number stays open.

    ``low`` (...) is the sum of all light at the low frequency, ``ratio`` times the base frequency,
    and ``std_rad`` the standard deviation of its phase before smoothing. Of the returns (K, ...)
    the one that is said to come first may be later light of the next turn: where the low phase is
    far better predicted by another order of those above the ``threshold``, that is taken. Open is
    what another number explains nearly as well: by noise, or as light of several turns is mixed.
    """
    xp, square = namespace(found.phase_rad), (std_rad / ratio) ** 2
    if low.ndim == 2 and sigma_px > 0:
        noisy = square * _left(sigma_px) > _NOISY_RAD**2
        square = square * xp.where(noisy, _left(_WIDE_PX), _left(sigma_px))
        low = xp.where(noisy, *(smooth(low[None], px)[0] for px in (_WIDE_PX, sigma_px)))
    weight = xp.where(weight > 0, weight, 0.0)
    phase = xp.where(weight > 0, phase, 0.0)
    best = [*found, _passed(ratio, low, found.phase_rad, phase, weight)]
    enough = (weight >= threshold * weight.max(axis=0)) & (weight > 0)
    doubtful = (_rest(best[3]) > _DOUBTFUL_RAD) & (enough.sum(axis=0) > 1)
    for first, light, there in zip(phase, weight, enough, strict=True) if some(doubtful) else ():
        tried = _passed(ratio, low, first, phase, weight)
        better = doubtful & there & (_rest(tried) < _rest(best[3]) - _DOUBTFUL_RAD / 2)
        new = light, best[0] + best[1] - light, first, tried
        best = [xp.where(better, *each) for each in zip(new, best, strict=True)]
    direct, indirect, first, passed = best
    whole = xp.maximum(xp.round(passed), 0.0)
    off = xp.where(whole > 0, abs(passed - whole), passed - whole)  # there are not less than 0
    lead = _TURN**2 * (1 - 2 * off) / (square + _UNMODELLED_RAD**2)
    return Separation(direct, indirect, first + _TURN * whole), ambiguous(lead, SIGNIFICANCE)


def _passed(ratio: float, low: Array, first: Array, phase: Array, weight: Array) -> Array:
    """Return the turns before the first return (P), not whole, if others (K, P) are behind it."""
    xp = namespace(first)
    # what is just before it, as of another estimate, is before it
    behind = xp.remainder(phase - first + 1.0, _TURN) - 1.0
    seen = (weight * xp.exp(1j * ratio * behind)).sum(axis=0)
    seen = xp.where(weight.sum(axis=0) > 0, seen, 1.0) * xp.exp(1j * ratio * first)
    apart = low * xp.conj(seen)
    turn = xp.arctan2(apart.imag, apart.real) / _TURN
    return (xp.remainder(turn + _BEFORE, 1.0) - _BEFORE) / ratio


def _rest(passed: Array) -> Array:
    """Return how far turns are from whole ones, as a phase."""
    return _TURN * abs(passed - namespace(passed).round(passed))


def _left(sigma_px: float) -> float:
    """Return the share of the variance that smoothing leaves where all pixels are alike."""
    return float((gaussian_taps(sigma_px) ** 2).sum()) ** 2
