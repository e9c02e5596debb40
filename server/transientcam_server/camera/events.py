"""What the acquisition reports."""

from dataclasses import dataclass

from transientcam_driver import AppliedSequence, RawFrame


@dataclass(frozen=True, slots=True)
class Captured:
    """A frame arrived, captured with this sequence."""

    raw: RawFrame
    applied: AppliedSequence


@dataclass(frozen=True, slots=True)
class Lost:
    """The camera is gone, or does not answer."""

    reason: str


@dataclass(frozen=True, slots=True)
class Back:
    """The camera is there again."""


@dataclass(frozen=True, slots=True)
class SequenceChanged:
    """Frames from now on are captured with another sequence."""

    applied: AppliedSequence


Event = Captured | Lost | Back | SequenceChanged
