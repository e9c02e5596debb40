"""The harmonics of the modulation, from the phase sweep of a calibration."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Capabilities
from transientcam_driver.calibration import LEAST_TAKES, SWEEP_STEPS

_Array = NDArray[Any]
COUNT: Final = SWEEP_STEPS - 2
"""Harmonics 3, 5, ..: those above 2 steps - 3 are aliases of as many above 2 steps."""
SWEEP_ON_A_SCENE: Final = "the phase sweep was measured on a scene"
"""Why its harmonics are not kept: where several returns meet, they are not those of one."""
LIT_SHARE: Final = 0.5
"""Share of the pixels that have to be lit, and not saturated, at every phase."""
LEAST_SIGNAL_DN: Final = 20.0
"""Amplitude of a pixel that counts as lit."""
MOST_PIXELS: Final = 20_000
"""Pixels that are evaluated, spread over the sensor: all share the harmonics."""


class SweepEvaluation:
    """Evaluates a phase sweep; what `capture_calibration` is given.

    Parameters
    ----------
    capabilities, takes
        Of the camera, and of the calibration.

    Attributes
    ----------
    reason
        Why no harmonics were found; None where they were.
    """

    def __init__(self, capabilities: Capabilities, *, takes: int) -> None:
        self._full_scale = 2.0**capabilities.bits - 1.0
        self.reason: str | None = None
        if not capabilities.phase_offsets:
            self.reason = "the camera cannot shift the phases of its images"
        elif takes < LEAST_TAKES:
            self.reason = f"a phase sweep needs a calibration of {LEAST_TAKES} takes or more"

    def __call__(self, steps: Iterator[NDArray[np.uint16]]) -> _Array | None:
        """Return the harmonics (m, K) of the takes (takes, 4 m, H, W) of each step, or None."""
        sampled = []
        for takes in steps:
            flat: _Array = takes.reshape((*takes.shape[:2], -1))
            sampled.append(flat[:, :, :: -(-flat[0, 0].size // MOST_PIXELS)])
        below = np.array([(flat < self._full_scale).all(axis=(0, 1)) for flat in sampled])
        used = np.flatnonzero(below.all(axis=0))
        lit = np.zeros(below.shape[1], bool)
        swept = None
        if used.size:
            swept = tm.sweep_phasors(np.stack([flat[:, :, used] for flat in sampled])).phasors
            lit[used] = ~(np.abs(swept) <= LEAST_SIGNAL_DN).any(axis=(0, 1))
        if swept is None or lit.mean() < LIT_SHARE:
            self.reason = (
                f"{1 - lit.mean():.0%} of the pixels are dark or saturated in the phase sweep "
                f"(at most {1 - LIT_SHARE:.0%})"
            )
            return None
        if not np.isfinite(swept).all():
            self.reason = "opposite images lost their synchronisation in all takes"
            return None
        found: _Array = tm.waveform_of(swept[:, :, lit[used]], COUNT)
        try:
            checked: _Array = tm.checked_waveform(found)
        except tm.ParameterError as error:
            self.reason = f"the harmonics are too strong to be taken out ({error})"
            return None
        return checked


def usable(waveform: _Array | None) -> _Array | None:
    """Return the waveform of a file where it can be taken out, else None."""
    try:
        return None if waveform is None else tm.checked_waveform(waveform)
    except tm.MomentsError:
        return None


def to_document(waveform: _Array | None) -> dict[str, Any] | None:
    """Return orders, shares of the fundamental and phases as JSON; None without any."""
    if waveform is None or not waveform.shape[1]:
        return None
    return {
        "orders": [2 * i + 3 for i in range(waveform.shape[1])],
        "share": np.abs(waveform).round(6).tolist(),
        "phase_rad": np.angle(waveform).round(4).tolist(),
        "largest_share": float(np.abs(waveform).max()),
    }
