"""What the camera captures for one transient image: frequencies, phases, exposures, takes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args

from transientcam_driver.errors import SequenceError
from transientcam_driver.sequence._fields import integer, known_keys, one_of, positive
from transientcam_driver.sequence._sampling import MAX_HARMONICS, Sampling

SPEED_OF_LIGHT_M_S = 299_792_458.0
LOW_FREQUENCY_HZ = 0.9e6
"""Where the zeroth moment is measured when the sensor cannot go unmodulated (Sec. 4.3)."""

Zeroth = Literal["low-frequency", "on-off", "estimated"]
Scheme = Literal["arccos", "harmonic-cancellation", "none"]
TakeOrder = Literal["sequential", "interleaved"]
Kind = Literal["off", "on", "modulated"]

DERIVED_FIELDS = (
    "images", "capture_s", "frame_rate_hz", "unambiguous_range_m", "data_rate_bytes_s",
)  # fmt: skip
"""What follows from a sequence on one camera: fields of an applied one and of its document."""
DRIVER_FIELDS = frozenset({"phase_offset_rad"})
"""What documents of a sequence do not have: only calibrations are measured with it."""
READ_ONLY_FIELDS = frozenset({"sequence_id", *DERIVED_FIELDS})
"""What a client may send back unchanged with a sequence's document; it is ignored."""


@dataclass(frozen=True, slots=True)
class SubPhases:
    """How one exposure is divided between phases to make the modulation sinusoidal (Sec. 4.1).

    ``arccos`` divides it evenly, ``harmonic-cancellation`` by sine weights, ``none`` not at all
    (and ``n`` is then 1).
    """

    scheme: Scheme = "arccos"
    n: int = 8

    def __post_init__(self) -> None:
        one_of("sub_phases.scheme", self.scheme, get_args(Scheme))
        integer("sub_phases.n", self.n, "an integer from 1 to 255", least=1, most=255)
        if self.scheme == "none":
            object.__setattr__(self, "n", 1)

    @property
    def phases_rad(self) -> tuple[float, ...]:
        """Phase of each part of the exposure."""
        if self.scheme == "arccos":
            # Eq. (3)
            return tuple(math.acos(1 - (2 * k + 1) / self.n) for k in range(self.n))
        if self.scheme == "harmonic-cancellation":
            return tuple(k * math.pi / (self.n + 1) for k in range(self.n))
        return (0.0,)

    @property
    def weights(self) -> tuple[float, ...]:
        """Share of the exposure spent at each phase; their sum is 1."""
        if self.scheme == "harmonic-cancellation":
            # Sec. 4.1, after Payne et al. 2010
            sines = [math.sin((k + 1) * math.pi / (self.n + 1)) for k in range(self.n)]
            total = sum(sines)
            return tuple(sine / total for sine in sines)
        return (1 / self.n,) * self.n

    def to_document(self) -> dict[str, Any]:
        """Return ``{"scheme", "n"}``."""
        return {"scheme": self.scheme, "n": self.n}

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "SubPhases":
        """Build from ``{"scheme", "n"}``; what is absent keeps its default."""
        known_keys("sub_phases", document, {"scheme", "n"})
        return cls(**document)


@dataclass(frozen=True, slots=True)
class ImageLabel:
    """What one image of a sequence shows.

    ``harmonic`` j means modulation at j times the base frequency, 0 the image for the zeroth
    moment; ``frequency_hz`` is 0 when nothing is modulated; without ``illumination`` the light
    stays off.
    """

    index: int
    take: int
    harmonic: int
    frequency_hz: float
    phase_rad: float
    exposure_s: float
    illumination: bool = True

    @property
    def kind(self) -> Kind:
        """What the light does: it is off, on without modulation, or modulated."""
        if not self.illumination:
            return "off"
        return "modulated" if self.frequency_hz > 0 else "on"


@dataclass(frozen=True, slots=True)
class Sequence:
    """The images of one transient image, as requested: a frozen value, checked when it is made.

    Attributes
    ----------
    base_frequency_hz
        f; measured are f, 2f, ..., ``harmonics`` times f, unless ``sampling`` has other multiples.
    harmonics
        m, from 1 to 32: how many frequencies there are.
    zeroth
        Where the zeroth moment comes from (Sec. 4.3): an image of each phase at 0.9 MHz, two
        unmodulated ones with the light on and off, or none (it is then estimated).
    exposure_s
        Of one image.
    takes
        How often each image is captured, for averaging.
    take_order
        ``sequential`` captures the whole set, then all of it again; ``interleaved`` each image as
        often as there are takes, then the next one.
    sub_phases
        Division of each exposure.
    phase_offset_rad
        Added to the phase of each modulated image, from 0 to a turn: one step of a phase sweep. Not
        part of documents.
    """

    base_frequency_hz: float = 23e6
    harmonics: int = 3
    zeroth: Zeroth = "low-frequency"
    exposure_s: float = 0.00192
    takes: int = 1
    sub_phases: SubPhases = field(default_factory=SubPhases)
    take_order: TakeOrder = "sequential"
    phase_offset_rad: float = 0.0
    sampling: Sampling = field(default_factory=Sampling)

    def __post_init__(self) -> None:
        positive("base_frequency_hz", self.base_frequency_hz, "a number of hertz above 0")
        integer(
            "harmonics",
            self.harmonics,
            f"an integer from 1 to {MAX_HARMONICS}",
            least=1,
            most=MAX_HARMONICS,
        )
        one_of("zeroth", self.zeroth, get_args(Zeroth))
        positive("exposure_s", self.exposure_s, "a number of seconds above 0")
        integer("takes", self.takes, "an integer of at least 1", least=1, most=None)
        one_of("take_order", self.take_order, get_args(TakeOrder))
        if not 0 <= self.phase_offset_rad < 2 * math.pi:
            raise SequenceError("phase_offset_rad", self.phase_offset_rad, "from 0 to a turn")
        if not isinstance(self.sub_phases, SubPhases):
            raise SequenceError("sub_phases", self.sub_phases, "an object {scheme, n}")
        if not isinstance(self.sampling, Sampling):
            raise SequenceError("sampling", self.sampling, "an object {multiples, phases_rad}")
        if self.harmonics != len(self.multiples):
            limit = f"{len(self.multiples)}: as many as the multiples {list(self.multiples)}"
            raise SequenceError("harmonics", self.harmonics, limit)
        object.__setattr__(self, "base_frequency_hz", float(self.base_frequency_hz))
        object.__setattr__(self, "exposure_s", float(self.exposure_s))

    @property
    def multiples(self) -> tuple[int, ...]:
        """Which multiples of the base frequency are measured, ascending."""
        return self.sampling.multiples_of(self.harmonics)

    @property
    def order(self) -> int:
        """The highest multiple, 32 at most: of the kernels that its frames are computed with."""
        return min(self.multiples[-1], MAX_HARMONICS)

    @property
    def images_per_take(self) -> int:
        """How many images one take holds."""
        phases = len(self.sampling.phases_rad)
        zeroth = {"low-frequency": phases, "on-off": 2, "estimated": 0}
        return zeroth[self.zeroth] + phases * self.harmonics

    @property
    def images(self) -> int:
        """How many images a transient image takes."""
        return self.images_per_take * self.takes

    @property
    def labels(self) -> tuple[ImageLabel, ...]:
        """The images in the order of capture, the zeroth moment measured at 0.9 MHz if at all."""
        return self.labels_at(LOW_FREQUENCY_HZ)

    def labels_at(self, low_frequency_hz: float) -> tuple[ImageLabel, ...]:
        """Label the images in the order of capture.

        Within a take frequencies, the zeroth moment first, then phases; ``take_order`` says
        whether takes follow one another as a whole or image by image.
        """
        of_a_take: list[tuple[int, float, float, bool]] = []
        steps_rad = self.sampling.phases_rad
        phases_rad = [self.phase_offset_rad + phase_rad for phase_rad in steps_rad]
        if self.zeroth == "on-off":
            of_a_take += [(0, 0.0, 0.0, True), (0, 0.0, 0.0, False)]
        elif self.zeroth == "low-frequency":
            of_a_take += [(0, low_frequency_hz, phase_rad, True) for phase_rad in phases_rad]
        for j in self.multiples:
            frequency_hz = j * self.base_frequency_hz
            of_a_take += [(j, frequency_hz, phase_rad, True) for phase_rad in phases_rad]
        order = [(take, image) for take in range(self.takes) for image in of_a_take]
        if self.take_order == "interleaved":
            order = [(take, image) for image in of_a_take for take in range(self.takes)]
        return tuple(
            ImageLabel(
                index=index,
                take=take,
                harmonic=harmonic,
                frequency_hz=frequency_hz,
                phase_rad=phase_rad,
                exposure_s=self.exposure_s,
                illumination=illumination,
            )
            for index, (take, (harmonic, frequency_hz, phase_rad, illumination)) in enumerate(order)
        )

    @property
    def frequency_changes(self) -> int:
        """How often the modulation changes in a frame that others of its kind follow."""
        groups = self.harmonics + (self.zeroth != "estimated")
        if groups == 1:
            return 0
        return groups * (self.takes if self.take_order == "sequential" else 1)

    def capture_s(self, readout_s: float) -> float:
        """Time from the first exposure to the last read-out."""
        return self.images * (self.exposure_s + readout_s)

    @property
    def unambiguous_range_m(self) -> float:
        """Range c / (2 f) beyond which a target appears nearer, or what the sampling states."""
        period_m = SPEED_OF_LIGHT_M_S / (2 * self.base_frequency_hz)
        return min(period_m, self.sampling.max_range_m or period_m)

    def to_document(self) -> dict[str, Any]:
        """Return the sequence as the JSON document of the REST interface.

        It has ``sampling`` only where that is not the usual one.
        """
        unusual = self.sampling != Sampling()
        sampling = {"sampling": self.sampling.to_document()} if unusual else {}
        return sampling | {
            "base_frequency_hz": self.base_frequency_hz,
            "harmonics": self.harmonics,
            "zeroth": self.zeroth,
            "exposure_s": self.exposure_s,
            "takes": self.takes,
            "take_order": self.take_order,
            "sub_phases": self.sub_phases.to_document(),
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "Sequence":
        """Build from a JSON document; what is absent keeps its default.

        What only an applied sequence has (``READ_ONLY_FIELDS``) is ignored, so that a document
        that was read can be changed and sent back.

        Raises
        ------
        SequenceError
            Naming the field, its value and the limit.
        """
        known = {each.name for each in fields(cls)} - DRIVER_FIELDS
        known_keys("", document, known | READ_ONLY_FIELDS)
        given = {name: value for name, value in document.items() if name in known}
        if "sub_phases" in given:
            given["sub_phases"] = SubPhases.from_document(given["sub_phases"])
        if "sampling" in given:
            given["sampling"] = Sampling.from_document(given["sampling"])
        return cls(**given)
