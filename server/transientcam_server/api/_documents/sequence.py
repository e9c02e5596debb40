"""The JSON documents about sequences."""

from typing import Literal

from pydantic import Field

from transientcam_server.api._documents.document import Document


class SubPhasesDocument(Document):
    """How one exposure is divided between phases (Sec. 4.1)."""

    scheme: Literal["arccos", "harmonic-cancellation", "none"] = "arccos"
    """How its parts are chosen; `none` has one."""
    n: int = Field(default=8, ge=1, le=255)
    """How many parts."""


class SamplingDocument(Document):
    """Which frequencies are measured and at which phases, where a camera has no choice."""

    multiples: list[int] = Field(default_factory=list)
    """Of the base frequency; empty for 1 to m."""
    phases_rad: list[float]
    """Of the images of each frequency."""
    max_range_m: float | None = None
    """No target is taken to be beyond it; null for what the frequencies tell apart."""


class SequenceDocument(Document):
    """What the camera captures for one transient image; what is absent keeps its default."""

    base_frequency_hz: float = Field(default=23e6, gt=0)
    """Modulation frequencies are this and its multiples."""
    harmonics: int = Field(default=3, ge=1, le=32)
    """m: how many multiples."""
    zeroth: Literal["low-frequency", "on-off", "estimated"] = "low-frequency"
    """Where the zeroth moment comes from; costs four, two or no images (Sec. 4.3)."""
    exposure_s: float = Field(default=0.00192, gt=0)
    """Of one image."""
    takes: int = Field(default=1, ge=1)
    """How often each image is captured, for averaging; whole images that are off are left out."""
    take_order: Literal["sequential", "interleaved"] = "sequential"
    """Whether takes follow one another as a whole, or image by image."""
    sub_phases: SubPhasesDocument = SubPhasesDocument()
    sampling: SamplingDocument | None = None
    """The camera's own, as its capabilities state it; null for the multiples 1 to m at four phases.
    No request has to name it."""


class AppliedDocument(SequenceDocument):
    """A sequence as the camera really set it, on the grid of its synthesiser."""

    sequence_id: int
    """Counts the sequences the camera was set to; 0 for one that was only checked."""
    images: int
    capture_s: float
    """From the first exposure to the last read-out of one capture by itself."""
    frame_rate_hz: float
    """When capturing back to back."""
    unambiguous_range_m: float
    data_rate_bytes_s: float
