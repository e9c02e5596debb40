"""Gains of each pixel, from a calibration measurement or nominal, and bad pixels."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import CalibrationCapture, FactoryCalibration, Sequence
from transientcam_server.imaging._recipe.waveform import usable

_Array = NDArray[Any]
NOMINAL_ID = "nominal"
"""Of the gains that sub-phases alone give an ideal modulation."""
FACTORY_ID = "factory"
"""Of the gains that a camera itself reports."""


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """What moments are divided by, of one calibration."""

    id: str
    """Name of the calibration."""
    planes: _Array
    """Shape (m + 1, H, W), complex64: the gain of each moment and pixel."""
    bad: _Array | None
    """Boolean array, shape (H, W): pixels that are hot, stuck, noisy or dead, and show their
    neighbours' mean instead; None where none are known."""
    waveform: _Array | None = None
    """Shape (m, K), complex128: odd harmonics of the modulation that are taken out of the moments;
    None where none are known."""
    temperature_c: float | None = None
    """Of the camera when they were measured; None where that is not known."""

    @property
    def bad_pixels(self) -> int:
        """How many pixels are bad."""
        return 0 if self.bad is None else int(np.count_nonzero(self.bad))

    @property
    def sizes(self) -> _Array:
        """The mean modulus (m + 1,) of the gains of each moment."""
        sizes: _Array = np.abs(self.planes).reshape((len(self.planes), -1)).mean(axis=1)
        return sizes


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A calibration measurement and the gains that follow from it."""

    capture: CalibrationCapture
    gains: Gains


def load_calibration(path: Path) -> Calibration:
    """Read and evaluate a measurement. Raises CalibrationFileError where the file holds none."""
    return evaluate(CalibrationCapture.load(path))


def evaluate(capture: CalibrationCapture) -> Calibration:
    """Compute gains and bad pixels from the images of a measurement (Sec. 4.2)."""
    zeroth, phases_rad = capture.sequence.zeroth, capture.sequence.sampling.phases_rad
    nominal = nominal_gains(capture.sequence)
    bad = tm.find_bad_pixels(
        dark=capture.dark,
        dark_deviation=capture.dark_deviation,
        brightness=_brightness(
            tm.measure(capture.images, zeroth=zeroth, phases_rad=phases_rad), nominal
        ),
    )
    filled = tm.fill_bad_pixels(capture.images, bad)
    measured = tm.measure(filled, zeroth=zeroth, phases_rad=phases_rad)
    measured[0] = _brightness(measured, nominal)
    # a brightness stays in digital numbers, as with nominal gains
    gains = tm.calibration_of(measured) * np.complex64(nominal[0])
    return Calibration(
        capture, Gains(capture.id, gains, bad, usable(capture.waveform), capture.temperature_c)
    )


def factory_gains(reported: FactoryCalibration | None) -> Gains | None:
    """Return the gains that a camera reports; None where it reports none."""
    if reported is None or reported.gains is None:
        return None
    return Gains(FACTORY_ID, reported.gains, None)


def calibration_id(gains: Gains | None) -> str:
    """Return the calibration id in the metadata of frames computed with these gains."""
    return NOMINAL_ID if gains is None else gains.id


def nominal_gains(sequence: Sequence, *, delay_s: float = 0.0) -> _Array:
    """Return the gains (m + 1,) that sub-phases and a delay give an ideal modulation.

    ``delay_s`` is what the light takes inside of the camera: a phase of 2 pi j f delay_s at the
    multiple j. The
    zeroth moment, a modulus or a difference, has none.
    """
    gains: _Array = tm.nominal_calibration(
        sequence.harmonics,
        sequence.sub_phases.phases_rad,
        sequence.sub_phases.weights,
        zeroth=sequence.zeroth,
    )
    turns = sequence.base_frequency_hz * delay_s * np.array((0, *sequence.multiples))
    return gains * np.exp(2j * np.pi * turns) if delay_s else gains


def _brightness(measured: _Array, nominal: _Array) -> _Array:
    """Return b_0 as it was measured, or else as the first harmonic would have it."""
    if measured[0].any():
        brightness: _Array = measured[0].real
        return brightness
    # estimated: the first harmonic of light at phase zero is as large as b_0, but for its gain
    return np.asarray(np.abs(measured[1]) / abs(nominal[1]), dtype=np.float32)
