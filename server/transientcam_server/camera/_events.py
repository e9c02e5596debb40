"""What the acquisition reports; clients are told events with a ``notice`` by their fields."""

from dataclasses import dataclass
from typing import ClassVar

from transientcam_driver import AppliedSequence, RawFrame
from transientcam_server.camera._darkness import Dark


@dataclass(frozen=True, slots=True)
class Captured:
    """A frame arrived, captured with this sequence."""

    raw: RawFrame
    applied: AppliedSequence


@dataclass(frozen=True, slots=True)
class CameraLostEvent:
    """The camera is unplugged or does not respond."""

    notice: ClassVar = "camera-lost"
    reason: str


@dataclass(frozen=True, slots=True)
class CameraRecoveredEvent:
    """A lost camera works again."""

    notice: ClassVar = "camera-back"


@dataclass(frozen=True, slots=True)
class LightArmingEvent:
    """The light goes on after this time, unless it is switched off before."""

    notice: ClassVar = "light-arming"
    in_s: float


@dataclass(frozen=True, slots=True)
class LightOffEvent:
    """The capture ended, and with it the light, until somebody starts it."""

    dark: Dark


@dataclass(frozen=True, slots=True)
class LightUnconfirmedEvent:
    """The light was to go off, and that takes long to be confirmed: it may be on."""

    notice: ClassVar = "light-unconfirmed"
    reason: str


@dataclass(frozen=True, slots=True)
class LightConfirmedEvent:
    """`LightUnconfirmedEvent` has ended: the light is off, or it was started again."""

    notice: ClassVar = "light-confirmed"


@dataclass(frozen=True, slots=True)
class SequenceChanged:
    """Frames from now on are captured with another sequence."""

    applied: AppliedSequence


@dataclass(frozen=True, slots=True)
class OriginChanged:
    """The service that is relayed calibrates in another way, or its camera looks elsewhere."""


Event = (
    Captured
    | CameraLostEvent
    | CameraRecoveredEvent
    | LightArmingEvent
    | LightOffEvent
    | LightUnconfirmedEvent
    | LightConfirmedEvent
    | SequenceChanged
    | OriginChanged
)
