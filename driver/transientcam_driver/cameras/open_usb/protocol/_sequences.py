"""Sequences on the wire: SET_SEQUENCE and COMMIT (usb-protocol 5.1, 5.2)."""

import struct
from dataclasses import dataclass

from transientcam_driver.camera import Capabilities
from transientcam_driver.cameras.open_usb.protocol._requests import VERSION
from transientcam_driver.cameras.open_usb.protocol._units import nanoseconds, phase_rad, phase_word
from transientcam_driver.errors import ProtocolError
from transientcam_driver.sequence import Scheme, Sequence, SubPhases, TakeOrder, Zeroth

# choices in the order of their codes (usb-protocol 5.1)
ZEROTHS: tuple[Zeroth, ...] = ("on-off", "low-frequency", "estimated")
SCHEMES: tuple[Scheme, ...] = ("none", "arccos", "harmonic-cancellation")
TAKE_ORDERS: tuple[TakeOrder, ...] = ("sequential", "interleaved")


@dataclass(frozen=True, slots=True)
class SequenceWords:
    """A sequence in the integers of the hardware: payload of SET_SEQUENCE, part of COMMIT's answer.

    Frequency j is ``j * base_word`` steps of the synthesiser, so that ratios are exact. The phase
    offset, in 1/65536 of a turn, is appended only where there is one.
    """

    harmonics: int
    zeroth: int
    scheme: int
    sub_phases: int
    base_word: int
    low_word: int
    exposure_ns: int
    takes: int
    take_order: int
    phase_offset: int

    _LAYOUT = struct.Struct("<BBBBBBHIII")
    _OFFSET = struct.Struct("<Hxx")
    BYTES = _LAYOUT.size
    MOST_BYTES = _LAYOUT.size + _OFFSET.size

    @classmethod
    def of(cls, sequence: Sequence, capabilities: Capabilities) -> "SequenceWords":
        """Round a sequence to the hardware's grid."""
        low_frequency = sequence.zeroth == "low-frequency"
        return cls(
            harmonics=sequence.harmonics,
            zeroth=ZEROTHS.index(sequence.zeroth),
            scheme=SCHEMES.index(sequence.sub_phases.scheme),
            sub_phases=sequence.sub_phases.n,
            base_word=capabilities.tuning_word(sequence.base_frequency_hz),
            low_word=capabilities.tuning_word(capabilities.low_frequency_hz) * low_frequency,
            exposure_ns=nanoseconds(sequence.exposure_s),
            takes=sequence.takes,
            take_order=TAKE_ORDERS.index(sequence.take_order),
            phase_offset=phase_word(sequence.phase_offset_rad),
        )

    def sequence(self, capabilities: Capabilities) -> Sequence:
        """Return the sequence that these integers stand for.

        Raises ProtocolError: an unknown code; SequenceError: a field out of every range.
        """
        codes = (
            ("zeroth moment", self.zeroth, ZEROTHS),
            ("scheme", self.scheme, SCHEMES),
            ("order of takes", self.take_order, TAKE_ORDERS),
        )
        for name, code, known in codes:
            if code >= len(known):
                raise ProtocolError(f"unknown code {code} for the {name}")
        return Sequence(
            base_frequency_hz=capabilities.frequency_hz(self.base_word),
            harmonics=self.harmonics,
            zeroth=ZEROTHS[self.zeroth],
            exposure_s=self.exposure_ns / 1e9,
            takes=self.takes,
            sub_phases=SubPhases(SCHEMES[self.scheme], self.sub_phases),
            take_order=TAKE_ORDERS[self.take_order],
            phase_offset_rad=phase_rad(self.phase_offset),
        )

    def word(self, harmonic: int) -> int:
        """Tuning word of a harmonic; harmonic 0 is the zeroth moment (usb-protocol 8.1)."""
        return self.base_word * harmonic if harmonic else self.low_word

    def pack(self) -> bytes:
        """Payload of SET_SEQUENCE."""
        words = self._LAYOUT.pack(
            VERSION, self.harmonics, self.zeroth, self.scheme, self.sub_phases, self.take_order,
            self.takes, self.base_word, self.low_word, self.exposure_ns,
        )  # fmt: skip
        return words + self._OFFSET.pack(self.phase_offset) if self.phase_offset else words

    @classmethod
    def unpack(cls, data: bytes) -> "SequenceWords":
        """Read the payload of SET_SEQUENCE."""
        if len(data) not in (cls.BYTES, cls.MOST_BYTES) or data[0] != VERSION:
            raise ProtocolError(f"{len(data)} bytes for a sequence of {cls.BYTES}")
        _, harmonics, zeroth, scheme, sub_phases, order, takes, base, low, exposure = (
            cls._LAYOUT.unpack_from(data)
        )
        offset = cls._OFFSET.unpack_from(data, cls.BYTES)[0] if len(data) > cls.BYTES else 0
        return cls(harmonics, zeroth, scheme, sub_phases, base, low, exposure, takes, order, offset)


@dataclass(frozen=True, slots=True)
class Commitment:
    """Answer to COMMIT: the epoch, what was really set, and the number of its first image."""

    epoch: int
    images: int
    first_image: int
    image_period_ns: int
    words: SequenceWords

    _LAYOUT = struct.Struct("<IIQI")
    BYTES = _LAYOUT.size + SequenceWords.BYTES
    MOST_BYTES = _LAYOUT.size + SequenceWords.MOST_BYTES

    def pack(self) -> bytes:
        """Bytes of the answer."""
        front = self._LAYOUT.pack(self.epoch, self.images, self.first_image, self.image_period_ns)
        return front + self.words.pack()

    @classmethod
    def unpack(cls, data: bytes) -> "Commitment":
        """Read the answer."""
        if len(data) not in (cls.BYTES, cls.MOST_BYTES):
            raise ProtocolError(f"answer of {len(data)} bytes to COMMIT, {cls.BYTES} needed")
        epoch, images, first_image, period_ns = cls._LAYOUT.unpack_from(data)
        words = SequenceWords.unpack(data[cls._LAYOUT.size :])
        return cls(epoch, images, first_image, period_ns, words)
