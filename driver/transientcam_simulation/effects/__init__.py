"""Effects on light on its way to a number, one file each.

Each effect judges for a scene and a sequence whether it is called for, why, how large it is and
what it costs. One that is not called for is not built: it costs nothing and draws no random
number. A new effect is a file here and an entry in ``EFFECTS``.
"""

from transientcam_simulation.effects._ambient_light import AmbientLight
from transientcam_simulation.effects._conditions import (
    CALLED_ABOVE,
    WORST_ABOVE,
    Call,
    Conditions,
)
from transientcam_simulation.effects._dark_current import DarkCurrentElectrons
from transientcam_simulation.effects._distortion import Distortion
from transientcam_simulation.effects._effect import (
    Effect,
    Exposure,
    ImageEffect,
    LightEffect,
    LightPlanes,
    NormalDraw,
    PlaneEffect,
    Shot,
    ShotEffect,
    Stage,
)
from transientcam_simulation.effects._glimpses import Facts, Glimpse, Noise, Values
from transientcam_simulation.effects._gloss import Gloss
from transientcam_simulation.effects._interreflection import DiffuseInterreflection
from transientcam_simulation.effects._lens_scatter import LensScatter
from transientcam_simulation.effects._mirror_paths import MirrorPaths
from transientcam_simulation.effects._missing import Missing, missing_calls
from transientcam_simulation.effects._mixed_pixels import MixedPixels
from transientcam_simulation.effects._modulation_harmonics import (
    ModulationHarmonics,
    measured_harmonics,
)
from transientcam_simulation.effects._motion import MotionDuringSequence
from transientcam_simulation.effects._pixel_pattern import PixelPattern, read_offsets_rad
from transientcam_simulation.effects._quantisation import Quantisation
from transientcam_simulation.effects._read_noise import ReadNoise
from transientcam_simulation.effects._roll_off import AmplitudeRollOff
from transientcam_simulation.effects._saturation import Saturation
from transientcam_simulation.effects._scattering import Scattering
from transientcam_simulation.effects._shot_noise import FEW_E, ShotNoise, draw_few
from transientcam_simulation.effects._synchronisation_outliers import SynchronisationOutliers
from transientcam_simulation.effects._thermal_drift import ThermalDrift
from transientcam_simulation.effects._vignetting import Vignetting

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
