"""What a scene and a sequence call for, effect by effect, as a table."""

from dataclasses import dataclass
from typing import Any

from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation.effects import CALLED_ABOVE


@dataclass(frozen=True, slots=True)
class ExplainedEffect:
    """One effect's answer.

    Attributes
    ----------
    choice
        "auto", "on" or "off"; "always" where there is no choice.
    called_for, built
        What the effect says, and what the choice makes of it.
    size_dn, relative
        The error it causes in one moment, as a root mean square, and that over the noise floor.
    cost_s
        Of one frame, by the order of magnitude; what is computed once a sequence costs nothing.
    """

    effect: str
    choice: str
    called_for: bool
    built: bool
    reason: str
    size_dn: float
    relative: float
    cost_s: float


@dataclass(frozen=True, slots=True)
class Explanation:
    """All effects' answers for a scene and a sequence.

    ``floor_dn`` is the noise floor of one moment of a typical pixel: shot noise, read noise and
    rounding, averaged over the takes. An effect is called for above ``threshold`` of it.
    """

    scene: str
    device: str
    sequence: Sequence
    floor_dn: float
    effects: tuple[ExplainedEffect, ...]
    threshold: float = CALLED_ABOVE

    def to_document(self) -> dict[str, Any]:
        """Return it as a JSON document."""
        return {
            "scene": self.scene,
            "device": self.device,
            "sequence": self.sequence.to_document(),
            "noise_floor_dn": self.floor_dn,
            "called_above": self.threshold,
            "effects": [
                {name: getattr(each, name) for name in ExplainedEffect.__slots__}
                for each in self.effects
            ],
        }
