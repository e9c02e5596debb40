"""Effects on light on its way to a number, by where they happen.

Each effect judges for a scene and a sequence whether it is called for, why, how large it is and
what it costs. One that is not called for is not built: it costs nothing and draws no random
number. A new effect is a class here and an entry in ``EFFECTS``.
"""

from transientcam_simulation.effects._ambient_light import AmbientLight
from transientcam_simulation.effects._conditions import CALLED_ABOVE, WORST_ABOVE, Call, Conditions
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
from transientcam_simulation.effects._faults import (
    Blooming,
    Crosstalk,
    Flicker,
    Ghost,
    HotPixels,
    Jitter,
    LensScatter,
    NoisyPixels,
    NonLinearity,
    OtherCamera,
)
from transientcam_simulation.effects._glimpses import Facts, Glimpse, Noise, Values
from transientcam_simulation.effects._in_scene import (
    DiffuseInterreflection,
    GlassPanes,
    Gloss,
    MirrorPaths,
    MixedPixels,
    MotionBlur,
    MotionDuringSequence,
    Scattering,
)
from transientcam_simulation.effects._missing import Missing, missing_calls
from transientcam_simulation.effects._modulation_harmonics import (
    ModulationHarmonics,
    measured_harmonics,
)
from transientcam_simulation.effects._of_lamp import (
    AmplitudeRollOff,
    SynchronisationOutliers,
    ThermalDrift,
)
from transientcam_simulation.effects._of_lens import Distortion, Vignetting
from transientcam_simulation.effects._of_sensor import (
    FEW_E,
    DarkCurrentElectrons,
    Quantisation,
    ReadNoise,
    Saturation,
    ShotNoise,
    draw_few,
)
from transientcam_simulation.effects._pixel_pattern import PixelPattern, read_offsets_rad

CHOICES = ("auto", "on", "off")

NOISE = (ShotNoise, ReadNoise)
"""Switched off by ``noise=off``."""

EFFECTS: tuple[type[Effect], ...] = (
    Distortion, MirrorPaths, GlassPanes, Gloss, DiffuseInterreflection, Scattering, MixedPixels,
    MotionDuringSequence, MotionBlur, ModulationHarmonics, AmbientLight, Flicker, OtherCamera,
    AmplitudeRollOff, LensScatter, Ghost, Vignetting, Crosstalk, PixelPattern,
    DarkCurrentElectrons, ThermalDrift, SynchronisationOutliers, Jitter, HotPixels, Blooming,
    Saturation, *NOISE, NoisyPixels, NonLinearity, Quantisation,
)  # fmt: skip
"""In the order in which they happen."""
