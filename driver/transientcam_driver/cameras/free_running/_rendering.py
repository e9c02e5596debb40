"""From measurements to the images of a sequence: of 16 bits, at equal phases of each frequency.

All that stands behind a camera takes labelled images. What a device measures becomes such ones, as
fine as 16 bits are, with the sensor and the gains that give its moments and their noise back.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Sensor
from transientcam_driver.cameras.free_running._measurement import (
    Capture,
    Description,
    Exposure,
    Moment,
    require,
)
from transientcam_driver.sequence import FOUR_PHASES_RAD

BITS: Final = 16
_HIGHEST: Final = (1 << BITS) - 1
_DARK_DN: Final = 4096.0
_MIDDLE_DN: Final = 32768.0
"""Of images that are differences, or beside them."""
_ROUNDING: Final = 1 / 12
_USUAL_LIGHT: Final = 0.1
"""Of what the converter holds."""
_NO_SHOT_NOISE_E: Final = 1e6
"""Electrons a DN: moments state all of their noise."""
_SAME_RAD: Final = 1e-6
_Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class _Group:
    """The measurements of one frequency: ``places`` in a frame; images are matrix @ values."""

    places: tuple[int, ...]
    matrix: _Array
    taken: float
    """How many values, each with the noise of one exposure, an image has the noise of the mean of;
    of a moment 1."""


class Renderer:
    """Makes the images (N, H, W) of one take, frequency by frequency, of the frames of a device.

    ``phases_rad``: of the images of each frequency.
    ``sensor``: whose noise the images have; None where nobody knows that of the exposures.
    ``gains``: complex64 (m + 1, H, W), what moments are divided by; None where they are 1.
    ``dark_dn``: of images that are differences; None of those that hold light.
    Raises ProtocolError where the measurements of a frequency are no moment.
    """

    def __init__(self, description: Description) -> None:
        self._about = description
        measurements = description.measurements
        by_frequency: dict[float, list[int]] = {}
        for at, each in enumerate(measurements):
            by_frequency.setdefault(each.frequency_hz, []).append(at)
        ordered = [by_frequency[f_hz] for f_hz in sorted(by_frequency)]
        self.phases_rad = self._common_phases(ordered)
        self._groups = [self._group(places) for places in ordered]
        moments = [each for each in measurements if isinstance(each, Moment)]
        self.dark_dn = _MIDDLE_DN if moments else None
        self._dark_dn = _MIDDLE_DN if moments else _DARK_DN
        self._scales = self._scaled(moments)
        self.sensor = self._sensor(moments)
        self.gains = self._gains()

    def images(self, capture: Capture) -> NDArray[np.uint16]:
        """Return the images of a frame. Raises ProtocolError where it does not fit."""
        about = self._about
        count = len(about.measurements)
        require("images", len(capture.images) == count, f"{count} a frame", len(capture.images))
        for at, image in enumerate(capture.images):
            shape = np.shape(image)
            require(f"images[{at}]", shape == about.size, f"(H, W) = {about.size}", shape)
        found = [
            self._of_frequency(group, scale, capture.images)
            for group, scale in zip(self._groups, self._scales, strict=True)
        ]
        return np.concatenate(found)

    def _of_frequency(
        self, group: _Group, scale: _Array, images: Sequence[_Array]
    ) -> NDArray[np.uint16]:
        """Return the images of a frequency; of a spoilt pixel all are of the highest code."""
        first = self._about.measurements[group.places[0]]
        if isinstance(first, Moment):
            moment = np.asarray(images[group.places[0]])
            spoilt = abs(moment) > first.largest
            values = np.nan_to_num(np.stack([moment.real, moment.imag]))
        else:
            values = np.stack([self._light(at, images[at]) for at in group.places])
            spoilt = np.any([images[at] >= (1 << self._about.bits) - 1 for at in group.places], 0)
        made = np.tensordot(group.matrix, values, 1) * scale + self._dark_dn
        made = np.rint(np.clip(made, 0, _HIGHEST - 1))
        return np.where(spoilt, _HIGHEST, made).astype(np.uint16)

    def _light(self, at: int, image: _Array) -> _Array:
        of = self._about.measurements[at]
        assert isinstance(of, Exposure)  # noqa: S101 - groups are of one kind
        return (image - np.asarray(of.offset_dn)) / of.gain

    # -- what is the same for all frames --------------------------------------------------------

    def _common_phases(self, ordered: list[list[int]]) -> tuple[float, ...]:
        """Return the phases where all frequencies have the same, each as often; else four."""
        common: _Array | None = None
        for places in ordered:
            kinds = [self._about.measurements[at] for at in places]
            phases = [each.phase_rad for each in kinds if isinstance(each, Exposure)]
            distinct, counts = np.unique(_turned(phases), return_counts=True)
            same = common is None or (
                len(distinct) == len(common) and np.allclose(distinct, common, atol=_SAME_RAD)
            )
            if len(distinct) < 3 or not same or len(set(counts)) > 1:
                return FOUR_PHASES_RAD
            common = distinct
        return FOUR_PHASES_RAD if common is None else tuple(common.tolist())

    def _group(self, places: list[int]) -> _Group:
        """Return how the images of a frequency are made of its measurements."""
        kinds = [self._about.measurements[at] for at in places]
        wanted = np.array(self.phases_rad)
        turning = np.stack([np.cos(wanted), np.sin(wanted)], axis=1) / 2
        alike = len(kinds) == 1 or all(isinstance(each, Exposure) for each in kinds)
        require("measurements", alike, "one moment, or exposures, of each frequency", kinds)
        if isinstance(kinds[0], Moment):
            return _Group(tuple(places), turning, 1.0)
        phases = _turned([each.phase_rad for each in kinds if isinstance(each, Exposure)])
        same = abs(wanted[:, None] - phases) < _SAME_RAD
        repeats = same.sum(axis=1)
        if len(set(repeats)) == 1 and repeats.sum() == len(phases):
            return _Group(tuple(places), same / repeats[0], float(repeats[0]))
        design = np.column_stack([np.ones(len(phases)), np.cos(phases) / 2, np.sin(phases) / 2])
        name, limit = f"phases of {kinds[0].frequency_hz:g} Hz", "three different ones or more"
        require(name, np.linalg.matrix_rank(design, 1e-3) == 3, limit, phases.tolist())
        solved = np.linalg.pinv(design)
        known = self._about.sensor is not None
        require("sensor", known, "stated, for phases that differ by frequency", None)
        # four images have a moment of twice their variance
        taken = 2 / (solved[1:] ** 2).sum(axis=1).mean()
        return _Group(
            tuple(places), np.column_stack([np.ones(len(wanted)), turning]) @ solved, float(taken)
        )

    def _scaled(self, moments: list[Moment]) -> list[_Array]:
        """Return by what each frequency is multiplied: all images have the noise of one sensor."""
        about = self._about
        room = min(self._dark_dn, _HIGHEST - self._dark_dn) if moments else _HIGHEST - _DARK_DN
        firsts = [about.measurements[group.places[0]] for group in self._groups]
        least = [np.min(each.gain) for each in about.measurements if isinstance(each, Exposure)]
        most_taken = max(group.taken for group in self._groups)
        # DN a DN of the device
        finer = room / ((1 << about.bits) / min(least)) if least else 1.0
        # the noise of an image of a moment, where none is larger than there is room for
        self._noise_dn = min(
            (math.sqrt(2) * room * np.min(each.std) / each.largest for each in moments),
            default=math.inf,
        )
        known = about.sensor
        if known is not None and least and moments:  # exposures beside them: the same noise
            of_one = _read_dn(known) * finer / math.sqrt(most_taken)
            self._noise_dn = min(self._noise_dn, of_one)
            finer *= self._noise_dn / of_one
        return [
            np.asarray(self._noise_dn * math.sqrt(2) / each.std)
            if isinstance(each, Moment)
            else np.asarray(finer * math.sqrt(group.taken / most_taken) / self._louder(each))
            for each, group in zip(firsts, self._groups, strict=True)
        ]

    def _louder(self, of: Exposure) -> float:
        """Return by how much more noise than the first one's an exposure of another length has.

        At a usual light: read noise stays, and shot noise grows.
        """
        known, first = self._about.sensor, self._about.measurements[self._groups[0].places[0]]
        if known is None or not isinstance(first, Exposure):
            return 1.0
        shot = _USUAL_LIGHT * (1 << self._about.bits) / known.gain_e_per_dn
        longer, read = of.exposure_s / first.exposure_s, _read_dn(known) ** 2
        return math.sqrt((read + shot * longer) / (read + shot))

    def _sensor(self, moments: list[Moment]) -> Sensor | None:
        """Return whose noise the images have."""
        if moments:
            read_dn = math.sqrt(max(self._noise_dn**2 - _ROUNDING, 0.0))
            read_e = read_dn * _NO_SHOT_NOISE_E
            full_e = _NO_SHOT_NOISE_E * _HIGHEST
            return Sensor(full_e, _NO_SHOT_NOISE_E, read_e, _MIDDLE_DN, BITS)
        known, taken, finer = self._about.sensor, self._groups[0].taken, float(self._scales[0])
        if known is None:
            return None
        gain = taken * known.gain_e_per_dn / finer
        read_e = _read_dn(known) * finer / math.sqrt(taken) * gain
        return replace(
            known,
            full_well_e=taken * known.full_well_e,
            gain_e_per_dn=gain,
            read_noise_e=read_e,
            dark_dn=_DARK_DN + finer * known.dark_dn,
            bits=BITS,
        )

    def _gains(self) -> NDArray[np.complex64] | None:
        planes = [np.ones(self._about.size, np.complex128)]
        for group, scale in zip(self._groups, self._scales, strict=True):
            first = self._about.measurements[group.places[0]]
            reference = self._about.measurements[self._groups[0].places[0]]
            gain = np.asarray(scale / np.median(self._scales[0]), np.complex128)
            if isinstance(first, Moment):
                gain = gain * first.gain
            elif isinstance(reference, Exposure):
                gain = gain * (first.exposure_s / reference.exposure_s)
            planes.append(gain + np.zeros(self._about.size))
        gains = np.stack(planes)
        return None if np.allclose(gains, 1, rtol=0, atol=1e-12) else gains.astype(np.complex64)


def _turned(phases_rad: Sequence[float]) -> _Array:
    """Return phases from 0 to a turn; those of equal ones are equal."""
    turned = np.mod(np.round(np.mod(phases_rad, 2 * np.pi) / _SAME_RAD) * _SAME_RAD, 2 * np.pi)
    exact = np.mod(np.asarray(phases_rad, dtype=np.float64), 2 * np.pi)
    near = abs(turned[:, None] - turned) < 2 * _SAME_RAD
    return exact[near.argmax(axis=1)] if len(turned) else turned


def _read_dn(sensor: Sensor) -> float:
    """Return the noise of a dark image, rounded to the converter's codes."""
    return math.sqrt((sensor.read_noise_e / sensor.gain_e_per_dn) ** 2 + _ROUNDING)
