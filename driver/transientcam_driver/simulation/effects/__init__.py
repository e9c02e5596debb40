"""Effects on light on its way to a number, one file each.

Each effect judges for a scene and a sequence whether it is called for, why, how large it is and
what it costs. One that is not called for is not built: it costs nothing and draws no random
number. A new effect is a file here and an entry in ``EFFECTS``.
"""

from transientcam_driver.simulation.effects.ambient_light import AmbientLight
from transientcam_driver.simulation.effects.conditions import (
    CALLED_ABOVE,
    WORST_ABOVE,
    Call,
    Conditions,
)
from transientcam_driver.simulation.effects.dark_current import DarkCurrentElectrons
from transientcam_driver.simulation.effects.distortion import Distortion
from transientcam_driver.simulation.effects.effect import Effect
from transientcam_driver.simulation.effects.gloss import Gloss
from transientcam_driver.simulation.effects.interreflection import DiffuseInterreflection
from transientcam_driver.simulation.effects.lens_scatter import LensScatter
from transientcam_driver.simulation.effects.mirror_paths import MirrorPaths
from transientcam_driver.simulation.effects.mixed_pixels import MixedPixels
from transientcam_driver.simulation.effects.modulation_harmonics import ModulationHarmonics
from transientcam_driver.simulation.effects.motion import MotionDuringSequence
from transientcam_driver.simulation.effects.pixel_pattern import PixelPattern
from transientcam_driver.simulation.effects.quantisation import Quantisation
from transientcam_driver.simulation.effects.read_noise import ReadNoise
from transientcam_driver.simulation.effects.roll_off import AmplitudeRollOff
from transientcam_driver.simulation.effects.saturation import Saturation
from transientcam_driver.simulation.effects.scattering import Scattering
from transientcam_driver.simulation.effects.shot_noise import ShotNoise
from transientcam_driver.simulation.effects.synchronisation_outliers import (
    SynchronisationOutliers,
)
from transientcam_driver.simulation.effects.thermal_drift import ThermalDrift
from transientcam_driver.simulation.effects.vignetting import Vignetting

CHOICES = ("auto", "on", "off")

NOISE = (ShotNoise, ReadNoise)
"""Switched off by ``noise=off``."""

EFFECTS: tuple[type[Effect], ...] = (
    Distortion,
    MirrorPaths,
    Gloss,
    DiffuseInterreflection,
    Scattering,
    MixedPixels,
    MotionDuringSequence,
    ModulationHarmonics,
    AmbientLight,
    AmplitudeRollOff,
    LensScatter,
    Vignetting,
    PixelPattern,
    DarkCurrentElectrons,
    ThermalDrift,
    SynchronisationOutliers,
    Saturation,
    *NOISE,
    Quantisation,
)
"""In the order in which they happen."""

__all__ = [
    "CALLED_ABOVE",
    "CHOICES",
    "EFFECTS",
    "NOISE",
    "WORST_ABOVE",
    "Call",
    "Conditions",
    "Effect",
]
