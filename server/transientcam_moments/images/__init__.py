"""From raw images to calibrated moments: demodulation, calibration, smoothing, repair."""

from transientcam_moments.images import _phasors as phasors
from transientcam_moments.images._bad_pixels import (
    Replacement,
    checked_mask,
    fill_bad_pixels,
    find_bad_pixels,
)
from transientcam_moments.images._calibration import (
    calibrate,
    calibration_of,
    inverse_gains,
    nominal_calibration,
)
from transientcam_moments.images._four_bucket import (
    ZEROTH_IMAGES,
    demodulate,
    four_bucket,
    harmonics_of,
    measure,
    saturated,
    takes_first,
)
from transientcam_moments.images._harmonics import (
    Corrected,
    HarmonicCorrection,
    checked_waveform,
    matters,
)
from transientcam_moments.images._modulation import modulation_gain
from transientcam_moments.images._phase_steps import (
    FOUR_PHASES_RAD,
    LEAST_PHASES,
    SAME_PHASE_RAD,
    is_four_bucket,
    phase_noise,
    phase_weights,
)
from transientcam_moments.images._repair import Repair, repair
from transientcam_moments.images._saturation import Recovered, recover_saturated
from transientcam_moments.images._smoothing import SIGMA_PX, gaussian_taps, smooth
from transientcam_moments.images._sweep import (
    SweepPhasors,
    sweep_offsets_rad,
    sweep_phasors,
    waveform_of,
)
from transientcam_moments.images._takes import Average, average_takes
