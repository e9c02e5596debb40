"""What happens to light on its way to a number, one file an effect.

Each effect says for a scene and a sequence whether it is called for, why, how large it is and
what it costs. One that is not called for is not built: it is never called and draws no random
number.
"""

from transientcam_driver.simulation.effects.effect import (
    Call,
    Conditions,
    Effect,
    Exposure,
    NormalDraw,
    Stage,
)
from transientcam_driver.simulation.effects.quantisation import Quantisation
from transientcam_driver.simulation.effects.read_noise import ReadNoise
from transientcam_driver.simulation.effects.shot_noise import ShotNoise

EFFECTS: tuple[type[Effect], ...] = (ShotNoise, ReadNoise, Quantisation)
"""In the order in which they happen."""

__all__ = [
    "EFFECTS",
    "Call",
    "Conditions",
    "Effect",
    "Exposure",
    "NormalDraw",
    "Quantisation",
    "ReadNoise",
    "ShotNoise",
    "Stage",
]
