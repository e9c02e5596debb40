"""A `Reconstructor` with its settings, and the `Reconstruction` that computes what is asked for."""

from transientcam_moments.reconstruction._flags import INVALID, Flags, flags
from transientcam_moments.reconstruction._labels import Labels
from transientcam_moments.reconstruction._lazy import Reconstruction
from transientcam_moments.reconstruction._ranging import SPEED_OF_LIGHT_M_S, range_m
from transientcam_moments.reconstruction._reconstructor import Reconstructor, reconstruct
from transientcam_moments.reconstruction._settings import (
    ESTIMATORS,
    NEIGHBOURS,
    OF_ANY_MULTIPLES,
    Settings,
    automatic,
    least_harmonics,
)
from transientcam_moments.reconstruction._still import Measured
