"""What a camera can do, and a sequence as it applies it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from transientcam_driver.errors import SequenceError
from transientcam_driver.sequence import (
    DERIVED_FIELDS,
    ImageLabel,
    Sampling,
    Scheme,
    Sequence,
    SubPhases,
    TakeOrder,
    Zeroth,
)

IMAGE_HEADER_BYTES = 64
BYTES_PER_PIXEL = 2


@dataclass(frozen=True, slots=True)
class AppliedSequence:
    """What was really set, after rounding to the grid of the camera's synthesiser and timer.

    ``epoch`` is the number the camera gave this configuration; every image carries it. It is 0
    when a sequence was only checked. ``delay_s`` is that of the capabilities.
    """

    sequence: Sequence
    epoch: int
    images: int
    capture_s: float
    frame_rate_hz: float
    unambiguous_range_m: float
    data_rate_bytes_s: float
    low_frequency_hz: float
    delay_s: float = 0.0

    @property
    def labels(self) -> tuple[ImageLabel, ...]:
        """The images in the order of capture, with the frequencies really set."""
        return self.sequence.labels_at(self.low_frequency_hz)

    def to_document(self) -> dict[str, Any]:
        """Return the sequence's document, its derived fields, and ``sequence_id``."""
        derived = {name: getattr(self, name) for name in DERIVED_FIELDS}
        return self.sequence.to_document() | {"sequence_id": self.epoch} | derived


@dataclass(frozen=True, slots=True, kw_only=True)
class Capabilities:
    """What a camera can do.

    Attributes
    ----------
    model, serial, firmware, protocol_version
        Which camera it is. Calibrations belong to a serial number.
    width, height, bits
        Of an image; the highest code of ``bits`` means that the pixel is saturated.
    readout_s, streaming_readout_s
        From the end of an exposure to the begin of the next one, in a single capture and back to
        back.
    settle_s
        What each change of the modulation frequency takes beside that.
    tuning_step_hz, min_frequency_hz, max_frequency_hz
        Modulation frequencies: multiples of the step.
    low_frequency_hz
        Where the zeroth moment is measured, with ``low-frequency``.
    min_exposure_s, max_exposure_s, exposure_step_s
        Exposures of one image: multiples of the step.
    max_harmonics, max_takes, max_sub_phases, max_images
        Of a sequence.
    schemes, zeroths, take_orders
        What a sequence can ask for.
    sampling
        Which multiples of the base frequency it measures, and at which phases: all sequences have
        these. With multiples of its own, ``max_harmonics`` is how many they are.
    phase_offsets
        Whether the phases of a sequence can be shifted together.
    delay_s
        What the light takes on its way inside of the camera, so that a moment at the frequency f
        comes with a phase of 2 pi f delay_s more; nominal gains take it away.
    dark_dn
        What an image holds where there is no light, if the camera's own format says so: images that
        are differences are 0 there, and show no ambient light; None where it is a property of the
        sensor.
    fifo_bytes
        Room for images in the camera; 0 where that is not known.
    clock
        Whose times the frames have: ``device``, of the camera's own clock, which begins anywhere;
        or ``ptp``, Unix time (no TAI) of a clock in it that PTP (IEEE 1588) disciplines.
    heartbeat_s
        The camera switches its light off by itself when it was not asked for anything for so long;
        0 where it does not.
    """

    model: str
    serial: str
    firmware: str
    protocol_version: int
    width: int
    height: int
    bits: int
    readout_s: float
    streaming_readout_s: float
    settle_s: float = 0.0
    tuning_step_hz: float
    min_frequency_hz: float
    max_frequency_hz: float
    low_frequency_hz: float = 0.0
    max_harmonics: int
    min_exposure_s: float
    max_exposure_s: float
    exposure_step_s: float = 1e-9
    max_takes: int = 256
    max_sub_phases: int = 1
    max_images: int = 2048
    schemes: tuple[Scheme, ...] = ("none",)
    zeroths: tuple[Zeroth, ...] = ("estimated",)
    take_orders: tuple[TakeOrder, ...] = ("sequential",)
    sampling: Sampling = field(default_factory=Sampling)
    phase_offsets: bool = False
    delay_s: float = 0.0
    fifo_bytes: int = 0
    heartbeat_s: float = 0.0
    dark_dn: float | None = None
    clock: Literal["device", "ptp"] = "device"

    @property
    def image_bytes(self) -> int:
        """Size of one image's pixels on the wire."""
        return self.width * self.height * BYTES_PER_PIXEL

    def validate(self, sequence: Sequence) -> None:
        """Check a sequence against what this camera can do.

        Raises
        ------
        SequenceError
            Naming the field, its value and the limit.
        """
        sequence = self._sampled(sequence)
        f_hz, m, highest = sequence.base_frequency_hz, sequence.harmonics, sequence.multiples[-1]
        if m > self.max_harmonics:
            raise SequenceError("harmonics", m, f"at most {self.max_harmonics} on this camera")
        if f_hz < self.min_frequency_hz:
            raise SequenceError("base_frequency_hz", f_hz, f"at least {self.min_frequency_hz:g} Hz")
        if self.tuning_word(f_hz) * highest > self.tuning_word(self.max_frequency_hz):
            stay = f"{m} harmonics have" if highest == m else f"the multiple {highest} has"
            limit = (
                f"at most {self.max_frequency_hz / highest:g} Hz: "
                f"{stay} to stay below {self.max_frequency_hz:g} Hz"
            )
            raise SequenceError("base_frequency_hz", f_hz, limit)
        if not self.min_exposure_s <= sequence.exposure_s <= self.max_exposure_s:
            limit = f"from {self.min_exposure_s:g} to {self.max_exposure_s:g} s"
            raise SequenceError("exposure_s", sequence.exposure_s, limit)
        if sequence.zeroth not in self.zeroths:
            limit = f"one of {', '.join(self.zeroths)} on this camera"
            raise SequenceError("zeroth", sequence.zeroth, limit)
        if sequence.sub_phases.scheme not in self.schemes:
            limit = f"one of {', '.join(self.schemes)} on this camera"
            raise SequenceError("sub_phases.scheme", sequence.sub_phases.scheme, limit)
        if sequence.sub_phases.n > self.max_sub_phases:
            limit = f"at most {self.max_sub_phases} on this camera"
            raise SequenceError("sub_phases.n", sequence.sub_phases.n, limit)
        if sequence.take_order not in self.take_orders:
            limit = f"one of {', '.join(self.take_orders)} on this camera"
            raise SequenceError("take_order", sequence.take_order, limit)
        if sequence.phase_offset_rad and not self.phase_offsets:
            raise SequenceError("phase_offset_rad", sequence.phase_offset_rad, "0 on this camera")
        most_takes = min(self.max_takes, self.max_images // sequence.images_per_take)
        if sequence.takes > most_takes:
            limit = f"at most {most_takes} with {sequence.images_per_take} images a take"
            raise SequenceError("takes", sequence.takes, limit)

    def nearest(self, sequence: Sequence) -> Sequence:
        """Return the nearest sequence to the one given that this camera can do."""
        harmonics = len(self.sampling.multiples) or min(sequence.harmonics, self.max_harmonics)
        highest = self.sampling.multiples_of(harmonics)[-1]
        highest_hz = self.frequency_hz(self.tuning_word(self.max_frequency_hz) // highest)
        sub_phases, schemes, zeroths = sequence.sub_phases, self.schemes, self.zeroths
        scheme = sub_phases.scheme if sub_phases.scheme in schemes else schemes[0]
        order = sequence.take_order if sequence.take_order in self.take_orders else "sequential"
        nearest = replace(
            sequence,
            harmonics=harmonics,
            base_frequency_hz=_clamped(
                sequence.base_frequency_hz, self.min_frequency_hz, highest_hz
            ),
            zeroth=sequence.zeroth if sequence.zeroth in zeroths else zeroths[0],
            exposure_s=_clamped(sequence.exposure_s, self.min_exposure_s, self.max_exposure_s),
            sub_phases=SubPhases(scheme, min(sub_phases.n, self.max_sub_phases)),
            take_order=order,
            sampling=self.sampling,
        )
        most_takes = min(self.max_takes, self.max_images // nearest.images_per_take)
        return replace(nearest, takes=min(sequence.takes, most_takes))

    def sequence_of(self, document: Mapping[str, Any]) -> Sequence:
        """Build a sequence from a JSON document, as `Sequence.from_document` does.

        What is absent takes its default, or where this camera cannot do that what is nearest.

        Raises
        ------
        SequenceError
            Naming the field, its value and the limit.
        """
        wanted = Sequence.from_document(document)
        possible = self.nearest(wanted)
        absent = {each.name for each in fields(Sequence)} - document.keys()
        filled = {name: getattr(possible, name) for name in absent}
        if "sub_phases" in document:
            given = document["sub_phases"]
            filled["sub_phases"] = SubPhases(
                (wanted if "scheme" in given else possible).sub_phases.scheme,
                (wanted if "n" in given else possible).sub_phases.n,
            )
        return replace(wanted, **filled)

    def apply(self, sequence: Sequence, *, epoch: int = 0) -> AppliedSequence:
        """Return a sequence as this camera would apply it, without a request to it."""
        self.validate(sequence)
        return self.describe(
            replace(
                self._sampled(sequence),
                base_frequency_hz=self.frequency_hz(self.tuning_word(sequence.base_frequency_hz)),
                exposure_s=self.exposure_grid_s(sequence.exposure_s),
            ),
            epoch=epoch,
        )

    def describe(self, sequence: Sequence, *, epoch: int) -> AppliedSequence:
        """Return a sequence that is set already, with its derived fields."""
        settling_s = self.settle_s * sequence.frequency_changes
        streaming_s = sequence.capture_s(self.streaming_readout_s) + settling_s
        frame_bytes = sequence.images * (IMAGE_HEADER_BYTES + self.image_bytes)
        return AppliedSequence(
            sequence=sequence,
            epoch=epoch,
            images=sequence.images,
            capture_s=streaming_s,
            frame_rate_hz=1 / streaming_s,
            unambiguous_range_m=sequence.unambiguous_range_m,
            data_rate_bytes_s=frame_bytes / streaming_s,
            low_frequency_hz=self.low_frequency_hz,
            delay_s=self.delay_s,
        )

    def _sampled(self, sequence: Sequence) -> Sequence:
        """Return a sequence with the camera's own sampling, which it may leave open or state."""
        if sequence.sampling not in (Sampling(), self.sampling):
            limit = f"{self.sampling.to_document()} on this camera, or absent"
            raise SequenceError("sampling", sequence.sampling.to_document(), limit)
        return replace(sequence, sampling=self.sampling)

    def frequency_hz(self, tuning_word: int) -> float:
        """Frequency the synthesiser makes from a tuning word."""
        return tuning_word * self.tuning_step_hz

    def tuning_word(self, frequency_hz: float) -> int:
        """Nearest tuning word of a frequency; harmonics use multiples of the base's word."""
        return round(min(frequency_hz / self.tuning_step_hz, 2.0**62))

    def exposure_grid_s(self, exposure_s: float) -> float:
        """Nearest exposure that the timer makes."""
        # by division, so that 25 us are 25e-6 and not 25.000000000000004e-6
        steps_per_s = round(1 / self.exposure_step_s)
        return round(exposure_s * steps_per_s) / steps_per_s


def _clamped(value: float, least: float, most: float) -> float:
    return max(least, min(most, value))
