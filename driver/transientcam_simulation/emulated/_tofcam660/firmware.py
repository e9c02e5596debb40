"""The emulated TOFcam660 without its sockets: a command in, an answer and maybe an image out."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.cameras.tofcam660 import (
    CODES_FROM,
    FULL,
    LOW_AMPLITUDE,
    MAX_FREQUENCY_HZ,
    MIN_FREQUENCY_HZ,
    AnswerType,
    CalibrationEntry,
    Command,
    ImageHeader,
    ImageType,
    Region,
    offset_m,
    pack_answer,
    pack_calibration,
)
from transientcam_driver.sequence import SPEED_OF_LIGHT_M_S
from transientcam_simulation.emulated._two_taps import DifferentialPixels

FIRMWARE: Final = (3, 59)
CHIP: Final = (7, 4242)
PRESETS_HZ: Final = {0: 12e6, 1: 24e6, 2: 6e6, 3: 3e6, 4: 1.5e6, 5: 0.75e6}
CALIBRATION: Final = tuple(
    CalibrationEntry(code, 39.0, offset_mm)
    for code, offset_mm in enumerate((8123, 8123, 8143, 8153, 8163, 8173))
)
"""All invented, but for the frequencies; the same as in the recorded session."""
_NAMED: Final = (Command.STOP_STREAM, Command.SET_FILTER, Command.SET_HDR, Command.SET_BINNING)
_IGNORED: Final = frozenset((*_NAMED, 28, 29, 39, 51, 54, 59, 60, 61))
"""Accepted without effect; the others are compensations, the step of the delay line, light for
grayscale images, segments of the illuminator, jitter, the type of triggered images, rolling mode,
and eye safety.
"""

_CONSTANT: Final[dict[int, bytes]] = {
    Command.READ_FIRMWARE: pack_answer(AnswerType.FIRMWARE, struct.pack("!HH", *FIRMWARE)),
    Command.READ_CHIP: pack_answer(AnswerType.CHIP, struct.pack("!HH", *CHIP)),
    Command.READ_CALIBRATION: pack_answer(AnswerType.CALIBRATION, pack_calibration(CALIBRATION)),
}

_Words = NDArray[np.uint16]


class _Refused(Exception):  # noqa: N818  (an answer of the device, not a failure)
    """A command is unknown, or asks for what is not possible."""


@dataclass
class EmulatedFirmware:
    """Settings and what they make of the light.

    ``pixels``: the sensor.
    ``clock``: time since power-up, in s.
    """

    pixels: DifferentialPixels
    clock: Callable[[], float]
    region: Region = FULL
    frequency_hz: float = 12e6
    integration_us: tuple[int, int, int, int] = (150, 0, 0, 50)
    minimum_amplitude: int = 0
    over_tcp: bool = False
    data_address: str | None = None
    registers: dict[int, int] = field(
        default_factory=lambda: {0x71: 1, 0x72: 2, 0x73: 3, 0x8B: 4, 0x93: 5, 0x88: 0x13}
    )

    def __post_init__(self) -> None:
        self._images: dict[int, Callable[[], bytes]] = {
            Command.GET_DISTANCE_AND_AMPLITUDE: self.distance_and_amplitude,
            Command.GET_DISTANCE: self.distance,
            Command.GET_GRAYSCALE: self.grayscale,
            Command.GET_DCS: self.dcs,
        }
        self._handlers: dict[int, Callable[[bytes], bytes | None]] = {
            Command.SET_ROI: self._set_region,
            Command.SET_INTEGRATION_TIMES: self._set_integration_times,
            Command.SET_MINIMUM_AMPLITUDE: self._set_minimum_amplitude,
            Command.SET_MODULATION_FREQUENCY: self._set_preset,
            Command.SET_FREE_FREQUENCY: self._set_free_frequency,
            Command.WRITE_REGISTER: self._write_register,
            Command.SET_DATA_PROTOCOL: self._set_data_protocol,
            Command.SET_DATA_ADDRESS: self._set_data_address,
            Command.READ_REGISTER: self._read_register,
            Command.READ_INTEGRATION_TIMES: self._read_integration_times,
            Command.READ_TEMPERATURE: self._read_temperature,
            Command.READ_DATA_PROTOCOL: self._read_data_protocol,
        }

    def handle(self, payload: bytes) -> tuple[bytes, bytes | None]:
        """Return the answer to a request, and the image that follows it, if any."""
        if len(payload) < 2:
            return pack_answer(AnswerType.NOT_ACKNOWLEDGED), None
        command, data = int.from_bytes(payload[:2], "big"), payload[2:]
        image = self._images.get(command)
        if image is not None:
            return _done(), image()
        if command in _IGNORED:
            return _done(), None
        if command in _CONSTANT:
            return _CONSTANT[command], None
        try:
            if command not in self._handlers:
                raise _Refused
            return self._handlers[command](data) or _done(), None
        except (_Refused, struct.error, IndexError):  # the latter of a request that is too short
            return pack_answer(AnswerType.NOT_ACKNOWLEDGED), None

    # --- settings ----------------------------------------------------------------------------

    def _set_region(self, data: bytes) -> None:
        wanted = Region(*struct.unpack_from("!4H", data))
        if not wanted.possible:
            raise _Refused
        self.region = wanted

    def _set_integration_times(self, data: bytes) -> None:
        low, mid, high, grayscale = struct.unpack_from("!4H", data)
        self.integration_us = (low, mid, high, grayscale)
        self.pixels.expose_for(max(1, low) * 1e-6)

    def _set_minimum_amplitude(self, data: bytes) -> None:
        (self.minimum_amplitude,) = struct.unpack_from("!H", data)

    def _set_preset(self, data: bytes) -> None:
        if data[0] not in PRESETS_HZ:
            raise _Refused
        self.frequency_hz = PRESETS_HZ[data[0]]

    def _set_free_frequency(self, data: bytes) -> None:
        (frequency_hz,) = struct.unpack_from("!I", data)
        if not MIN_FREQUENCY_HZ <= frequency_hz <= MAX_FREQUENCY_HZ:
            raise _Refused
        self.frequency_hz = float(frequency_hz)
        # now, since this may take seconds, and no image is awaited yet
        self.pixels.prepare(self.frequency_hz, max(1, self.integration_us[0]) * 1e-6)

    def _write_register(self, data: bytes) -> None:
        self.registers[data[0]] = data[1]

    def _set_data_protocol(self, data: bytes) -> None:
        self.over_tcp = bool(data[0])

    def _set_data_address(self, data: bytes) -> None:
        self.data_address = ".".join(map(str, data[:4]))

    # --- answers -----------------------------------------------------------------------------

    def _read_register(self, data: bytes) -> bytes:
        return pack_answer(AnswerType.REGISTER, bytes([self.registers.get(data[0], 0)]))

    def _read_integration_times(self, data: bytes) -> bytes:
        times = struct.pack("!4H", *self.integration_us)
        return pack_answer(AnswerType.INTEGRATION_TIMES, times)

    def _read_temperature(self, data: bytes) -> bytes:
        return pack_answer(AnswerType.TEMPERATURE, struct.pack("!h", round(self._celsius * 100)))

    def _read_data_protocol(self, data: bytes) -> bytes:
        return pack_answer(AnswerType.DATA_PROTOCOL, bytes([self.over_tcp]))

    # --- images ------------------------------------------------------------------------------

    @property
    def _celsius(self) -> float:
        return self.pixels.temperature_c(self.clock())

    def dcs(self) -> bytes:
        """Return the four differences."""
        return self._image(ImageType.DCS, self._differences())

    def distance_and_amplitude(self) -> bytes:
        """Return what the camera itself makes of them, in mm and DN, pixel by pixel."""
        distance_mm, amplitude = self._computed()
        both = np.stack([distance_mm, amplitude], axis=-1)
        return self._image(ImageType.DISTANCE_AND_AMPLITUDE, both)

    def distance(self) -> bytes:
        """Return the distance alone."""
        return self._image(ImageType.DISTANCE, self._computed()[0])

    def grayscale(self) -> bytes:
        """Return the light without its modulation."""
        exposure_s = max(1, self.integration_us[3]) * 1e-6
        light = self.pixels.sum(exposure_s, device_time_s=self.clock())
        return self._image(ImageType.GRAYSCALE, self._cropped(light))

    def _differences(self) -> _Words:
        inside_m = offset_m(CALIBRATION, self._celsius)
        images = self.pixels.differences(
            self.frequency_hz,
            max(1, self.integration_us[0]) * 1e-6,
            delay_s=2 * inside_m / SPEED_OF_LIGHT_M_S,
            device_time_s=self.clock(),
        )
        return self._cropped(images)

    def _computed(self) -> tuple[_Words, _Words]:
        images = self._differences()
        corrupt = images.max(axis=0)
        dcs = images.astype(np.float64)
        phasor = dcs[0] - dcs[2] + 1j * (dcs[1] - dcs[3])
        unambiguous_m = SPEED_OF_LIGHT_M_S / (2 * self.frequency_hz)
        measured_m = np.angle(phasor) / (2 * np.pi) * unambiguous_m
        distance_m = (measured_m - offset_m(CALIBRATION, self._celsius)) % unambiguous_m
        amplitude = np.rint(np.abs(phasor) / 2).astype(np.uint16)
        distance_mm = np.minimum(np.rint(distance_m * 1e3), CODES_FROM - 1).astype(np.uint16)
        distance_mm[amplitude < self.minimum_amplitude] = LOW_AMPLITUDE
        for plane in (distance_mm, amplitude):
            np.copyto(plane, corrupt, where=corrupt >= CODES_FROM)
        return distance_mm, amplitude

    def _cropped(self, images: _Words) -> _Words:
        left, top, right, bottom = self.region.edges
        return images[..., top:bottom, left:right]

    def _image(self, kind: ImageType, pixels: _Words) -> bytes:
        header = ImageHeader(
            kind=kind,
            columns=self.region.width,
            rows=self.region.height,
            region=self.region,
            integration_us=self.integration_us[:3],
            temperature_c=self._celsius,
        )
        return header.pack() + np.ascontiguousarray(pixels, dtype="<u2").tobytes()


def _done() -> bytes:
    return pack_answer(AnswerType.ACKNOWLEDGE)
