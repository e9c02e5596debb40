"""From phase to range."""

import math

from transientcam_moments.arrays import Array, as_array
from transientcam_moments.errors import ParameterError

SPEED_OF_LIGHT_M_S = 299_792_458.0


def range_m(phase_rad: Array, base_frequency_hz: float) -> Array:
    """Convert the phase of a return to range, half the way of the light.

    Parameters
    ----------
    phase_rad : array
        phi = 2 pi f tau in radian.
    base_frequency_hz : float
        f in Hz, > 0.

    Returns
    -------
    array
        c tau / 2 in m, in the shape and precision of `phase_rad`; NaN stays NaN.

    Raises
    ------
    ParameterError
        When the frequency is not positive and finite.

    Notes
    -----
    Sec. 3.1: one turn of the phase is the unambiguous range c / (2 f).
    """
    if not 0 < base_frequency_hz < math.inf:
        raise ParameterError("base_frequency_hz", base_frequency_hz, "> 0 and finite")
    return as_array(phase_rad) * (SPEED_OF_LIGHT_M_S / (4 * math.pi * base_frequency_hz))
