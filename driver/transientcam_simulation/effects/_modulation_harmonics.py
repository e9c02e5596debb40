"""Modulation harmonics: the correlation of light and reference is no pure sinusoid (Sec. 4.1)."""

import math
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.errors import SceneError
from transientcam_simulation.base import Waveform
from transientcam_simulation.effects._conditions import Call, Conditions, weigh
from transientcam_simulation.effects._effect import Effect

_HIGHEST = 9


class ModulationHarmonics(Effect):
    """Images at frequency f also contain moments at its multiples.

    Sub-phases and the four-bucket differences remove most of them; what is left is an error of
    the moments. The world reads the content at a frequency from ``harmonics``.
    """

    name = "modulation-harmonics"
    what = "the modulation is no pure sinusoid"
    figures = "waveform"

    @classmethod
    def called_for(cls, conditions: Conditions) -> Call:
        """Where the device has harmonics that sub-phases leave in the moments."""
        waveform = conditions.device.waveform
        if waveform is None:
            return Call(False, "the device modulates by a pure sinusoid", 0.0, 0.0)
        gain = abs(conditions.sub_phase_gain(1))
        left = max(
            _rms(
                abs(content * conditions.sub_phase_gain(k))
                for k, content in harmonics(waveform, frequency_hz).items()
                if k % 2 and k > 1  # four-bucket differences cancel the even ones
            )
            for frequency_hz in conditions.frequencies_hz
        )
        scheme = conditions.sequence.sub_phases.scheme
        reason = f"sub-phases ({scheme}) leave {left / gain:.2%} of other harmonics"
        return weigh(conditions, conditions.of_light(left), reason)

    def harmonics(self, frequency_hz: float) -> dict[int, complex]:
        """Content of the harmonics of a frequency, relative to the fundamental."""
        return harmonics(self._figures, frequency_hz)


def harmonics(waveform: Waveform, frequency_hz: float) -> dict[int, complex]:
    """Content of a waveform's harmonics; the fundamental's is 1."""
    if waveform.file is not None:
        return measured_harmonics(waveform.file)
    third = np.interp(frequency_hz, waveform.frequency_hz, waveform.third_harmonic)
    return {1: 1.0, 3: complex(third)}


@lru_cache(maxsize=8)
def measured_harmonics(path: Path) -> dict[int, complex]:
    """Harmonics of a measured correlation function: a .npy of (rows, samples) over one period.

    With rows in opposite pairs, their difference counts, which has no background; else the first
    row. Time zero is where the fundamental peaks.
    Raises SceneError where the file cannot be read, or has other content.
    """
    rows = _read(path)
    wave = rows[0] - rows[1] if len(rows) % 2 == 0 else rows[0]
    spectrum = np.fft.rfft(wave)[: _HIGHEST + 1]
    if not abs(spectrum[1]) > 0:
        raise SceneError(path, "the array", "no fundamental", "a correlation over one period")
    turn = np.exp(-1j * np.angle(spectrum[1]) * np.arange(len(spectrum)))
    relative = spectrum * turn / abs(spectrum[1])
    # a correlation over phase theta has the terms Re(c_k exp(-i k theta)): its spectrum, conjugate
    return {k: complex(np.conj(relative[k])) for k in range(1, len(relative))}


def _read(path: Path) -> NDArray[np.float64]:
    try:
        array = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise SceneError(path, "the file", str(error), "a readable .npy") from error
    fits = isinstance(array, np.ndarray) and array.dtype.kind in "uif" and array.ndim in (1, 2)
    if not fits or array.shape[-1] < 2 * _HIGHEST + 2 or not np.isfinite(array).all():
        shape = getattr(array, "shape", None)
        allowed = f"finite numbers (samples) or (rows, samples), {2 * _HIGHEST + 2} samples or more"
        raise SceneError(path, "the array", shape, allowed)
    return np.atleast_2d(array.astype(np.float64))


def _rms(values: Iterable[float]) -> float:
    return math.sqrt(sum(value * value for value in values))
