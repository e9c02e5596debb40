"""From measurements to the images of a sequence: of 16 bits, at equal phases of each frequency.

All that stands behind a camera takes labelled images. What a device measures becomes such ones, as
fine as 16 bits are, with the sensor and the gains that give its moments and their noise back.
"""

import math
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.camera import Sensor, finite, require
from transientcam_driver.cameras.free_running._measurement import (
    Capture,
    Description,
    Exposure,
    Measurement,
    Moment,
)
from transientcam_driver.sequence import FOUR_PHASES_RAD

BITS: Final = 16
_HIGHEST: Final = (1 << BITS) - 1
_DARK_DN: Final = 4096.0
_MIDDLE_DN: Final = 32768.0
"""Of images that are differences, or beside them."""
_LATEST_S: Final = 1e10
"""Of a device's clock: its nanoseconds are counted in 64 bits."""
_ROUNDING: Final = 1 / 12
_USUAL_LIGHT: Final = 0.1
"""Of what the converter holds."""
_NO_SHOT_NOISE_E: Final = 1e6
"""Electrons a DN: moments state all of their noise."""
_Array = NDArray[Any]


class _Group(NamedTuple):
    """The measurements of one frequency: ``places`` in a frame; images are matrix @ values.

    ``taken``: an image has the noise of the mean of so many values.
    """

    first: Measurement
    places: tuple[int, ...]
    matrix: _Array
    taken: float


class Renderer:
    """Makes the images (N, H, W) of one take, frequency by frequency, of the frames of a device.

    ``phases_rad``: of the images of each frequency.
    ``sensor``: whose noise the images have; None where nobody knows that of the exposures.
    ``gains``: complex64 (m + 1, H, W), what moments are divided by; None where they are 1.
    ``dark_dn``: of images that are differences; None of those that hold light.
    Raises ProtocolError where the measurements of a frequency are no moment.
    """

    def __init__(self, about: Description) -> None:
        self._about = about
        places: dict[float, list[int]] = {}
        for at, each in enumerate(about.measurements):
            places.setdefault(each.frequency_hz, []).append(at)
        ordered = [places[f_hz] for f_hz in sorted(places)]
        moments = [each for each in about.measurements if isinstance(each, Moment)]
        sampled = [_phases_of([about.measurements[at] for at in each]) for each in ordered]
        self.phases_rad = FOUR_PHASES_RAD if moments else _common(sampled)
        self._groups = [self._group(*each) for each in zip(ordered, sampled, strict=True)]
        self.dark_dn = _MIDDLE_DN if moments else None
        self._dark_dn = self.dark_dn or _DARK_DN
        self._scales = self._scaled(moments)
        self.sensor = self._sensor(bool(moments))
        gains = [np.ones(1), *map(self._gain, self._groups, self._scales)]
        same = all(np.allclose(gain, 1, rtol=0, atol=1e-12) for gain in gains)
        whole = [np.broadcast_to(gain, about.size) for gain in gains]
        self.gains = None if same else np.array(whole, np.complex64)

    def images(self, capture: Capture) -> NDArray[np.uint16]:
        """Return the images of a frame. Raises ProtocolError where it does not fit."""
        images, kinds = list(map(np.asarray, capture.images)), self._about.measurements
        found, wanted = [each.shape for each in images], len(kinds) * [self._about.size]
        require("images", found == wanted, f"a frame of {wanted}", found)
        numbers = ["buifc" if isinstance(each, Moment) else "buif" for each in kinds]
        types = [each.dtype for each in images]
        fit = all(each.kind in allowed for each, allowed in zip(types, numbers, strict=True))
        require("images", fit, "numbers, of exposures real ones", types)
        times = {"device_time_s": capture.device_time_s, "capture_s": capture.capture_s or 0.0}
        for name, value_s in times.items():
            known_s = finite(value_s)
            known = known_s is not None and abs(known_s) < _LATEST_S
            require(name, known, f"a number below {_LATEST_S:g} s", value_s)
        # a pixel without any moment has no light
        dark = np.all([np.isnan(each) for each in images if each.dtype.kind in "fc"], axis=0)
        with np.errstate(over="ignore", invalid="ignore"):  # of spoilt pixels
            made = [
                self._of_frequency(group, scale, [images[at] for at in group.places], dark)
                for group, scale in zip(self._groups, self._scales, strict=True)
            ]
        return np.concatenate(made)

    def _of_frequency(
        self, group: _Group, scale: _Array, images: list[_Array], dark: NDArray[np.bool_]
    ) -> NDArray[np.uint16]:
        """Return the images of a frequency; of a spoilt pixel all are of the highest code."""
        if isinstance(group.first, Moment):
            moment: Any = images[0]
            spoilt = ~(abs(moment) <= group.first.largest) & ~dark
            values = np.where(spoilt | dark, 0.0, np.stack([moment.real, moment.imag]))
        else:
            spoilt = ~(np.max(images, axis=0) < (1 << self._about.bits) - 1)  # as NaN is
            values = np.stack(list(map(self._light, group.places, images)))
            values = np.where(np.isfinite(values), values, 0.0)
        made = np.tensordot(group.matrix, values, 1)
        made *= scale
        made += self._dark_dn
        rounded = np.clip(np.rint(made, out=made), 0, _HIGHEST - 1, out=made).astype(np.uint16)
        rounded[:, spoilt] = _HIGHEST
        return rounded

    def _light(self, at: int, image: _Array) -> _Array:
        tap: Any = self._about.measurements[at]
        light: _Array = (image - np.asarray(tap.offset_dn)) / tap.gain
        return light

    # -- what is the same for all frames --------------------------------------------------------

    def _group(self, places: list[int], phases: _Array) -> _Group:
        """Return how the images of a frequency are made of its measurements."""
        first, wanted = self._about.measurements[places[0]], np.array(self.phases_rad)
        if isinstance(first, Moment):
            return _Group(first, tuple(places), _design(wanted)[:, 1:], 1.0)
        same = abs(wanted[:, None] - phases) < 1e-6
        repeats = same.sum(axis=1)
        if repeats.sum() == len(phases) and min(repeats) == max(repeats):
            return _Group(first, tuple(places), same / repeats[0], float(repeats[0]))
        name, limit = f"phases of {first.frequency_hz:g} Hz", "three different ones or more"
        full = np.linalg.matrix_rank(_design(phases), 1e-3) == _design(phases).shape[1]
        require(name, full, limit, phases.tolist())
        known = self._about.sensor is not None
        require("sensor", known, "stated, for phases that differ by frequency", None)
        solved = np.linalg.pinv(_design(phases))
        # four images have a moment of twice their variance
        taken = 2 / (solved[1:] ** 2).sum(axis=1).mean()
        return _Group(first, tuple(places), _design(wanted) @ solved, float(taken))

    def _scaled(self, moments: list[Moment]) -> list[_Array]:
        """Return by what each frequency is multiplied: all images have the noise of one sensor."""
        about, room = self._about, _HIGHEST - self._dark_dn
        least = [np.min(each.gain) for each in about.measurements if isinstance(each, Exposure)]
        most_taken = max(group.taken for group in self._groups)
        # DN a DN of the device
        finer = room / (1 << about.bits) * min(least, default=1.0)
        # the noise of an image of a moment, where none is larger than there is room for
        rooms = [math.sqrt(2) * room * np.min(each.std) / each.largest for each in moments]
        if about.sensor is not None and least and moments:  # exposures beside them: the same noise
            of_one = self._usual_dn(about.sensor) * finer / math.sqrt(most_taken)
            rooms.append(of_one)
            finer *= min(rooms) / of_one
        self._noise_dn = min(rooms, default=0.0)
        return [
            np.asarray(self._noise_dn * math.sqrt(2) / each.first.std)
            if isinstance(each.first, Moment)
            else np.asarray(finer * math.sqrt(each.taken / most_taken) / self._louder(each.first))
            for each in self._groups
        ]

    def _louder(self, of: Exposure) -> float:
        """Return by how much more noise than the first one's an exposure of another length has."""
        known, first = self._about.sensor, self._groups[0].first
        if known is None or not isinstance(first, Exposure):
            return 1.0
        return self._usual_dn(known, of.exposure_s / first.exposure_s) / self._usual_dn(known)

    def _usual_dn(self, sensor: Sensor, longer: float = 1.0) -> float:
        """Return the noise at a usual light: of the converter, and of what is longer exposed."""
        shot = longer * _USUAL_LIGHT * (1 << self._about.bits) / sensor.gain_e_per_dn
        return math.sqrt(_read_dn(sensor) ** 2 + shot)

    def _sensor(self, differences: bool) -> Sensor | None:
        """Return whose noise the images have."""
        known, taken, finer = (
            self._about.sensor,
            self._groups[0].taken,
            float(self._scales[0].flat[0]),
        )
        if differences:
            read_dn = math.sqrt(max(self._noise_dn**2 - _ROUNDING, 0.0))
            e_per_dn = _NO_SHOT_NOISE_E
            return Sensor(e_per_dn * _HIGHEST, e_per_dn, read_dn * e_per_dn, _MIDDLE_DN, BITS)
        if known is None:
            return None
        gain = taken * known.gain_e_per_dn / finer
        return replace(
            known,
            full_well_e=taken * known.full_well_e,
            gain_e_per_dn=gain,
            read_noise_e=_read_dn(known) * finer / math.sqrt(taken) * gain,
            dark_dn=_DARK_DN + finer * known.dark_dn,
            bits=BITS,
        )

    def _gain(self, group: _Group, scale: _Array) -> _Array:
        """Return what the moments of a frequency are divided by, one or (H, W)."""
        gain, reference = scale / np.median(self._scales[0]), self._groups[0].first
        if isinstance(group.first, Moment):
            gain = gain * group.first.gain
        elif isinstance(reference, Exposure):
            gain = gain * (group.first.exposure_s / reference.exposure_s)
        return np.asarray(gain)


def _phases_of(kinds: list[Measurement]) -> _Array:
    """Return the phases of exposures from 0 to a turn, to 1e-9; those of a moment are none."""
    phases = [each.phase_rad for each in kinds if isinstance(each, Exposure)]
    alike = len(phases) == len(kinds) or len(kinds) == 1
    require("measurements", alike, "one moment, or exposures, of each frequency", kinds)
    return np.mod(np.round(np.mod(phases, 2 * np.pi), 9), round(2 * np.pi, 9))


def _common(sampled: list[_Array]) -> tuple[float, ...]:
    """Return the phases where all frequencies have the same, each as often; else four."""
    found = [np.unique(phases, return_counts=True) for phases in sampled]
    distinct = {tuple(phases.tolist()) for phases, _ in found}
    even = all(min(counts) == max(counts) for _, counts in found)
    phases = distinct.pop()
    four = len(phases) == 4 and np.allclose(phases, FOUR_PHASES_RAD, atol=1e-8)
    return phases if even and not distinct and len(phases) > 2 and not four else FOUR_PHASES_RAD


def _design(phases_rad: _Array) -> _Array:
    """Return what (offset, real part, imaginary part) are multiplied by, of images at phases."""
    return np.column_stack(
        [np.ones(len(phases_rad)), np.cos(phases_rad) / 2, np.sin(phases_rad) / 2]
    )


def _read_dn(sensor: Sensor) -> float:
    """Return the noise of a dark image, rounded to the converter's codes."""
    return math.sqrt((sensor.read_noise_e / sensor.gain_e_per_dn) ** 2 + _ROUNDING)
