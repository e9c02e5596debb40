"""Gain and phase of every frequency, taken out by division (Sec. 4.2)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    chosen,
    moment_planes,
    namespace,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images._modulation import modulation_gain


def calibrate(moments: Array, calibration: Array) -> Array:
    """Divide measured moments by the gains of a calibration.

    Parameters
    ----------
    moments : array, shape (m + 1, ...)
        Measured moments.
    calibration : array, shape (m + 1,) or (m + 1, ...)
        Complex gain of each frequency, for all pixels alike or for each pixel, from
        `nominal_calibration` or `calibration_of`.

    Returns
    -------
    array, shape (m + 1, ...)
        In the precision of `moments`. A pixel whose gain is zero or not finite becomes NaN.

    Raises
    ------
    ShapeError
        When the calibration is neither one number a plane nor of the moments' shape.
    """
    planes, trailing = moment_planes(moments, name="moments")
    inverse = inverse_gains(calibration, (planes.shape[0], *trailing), namespace(planes))
    inverse = inverse.astype(planes.dtype).reshape((planes.shape[0], -1))
    return (planes * inverse).reshape((planes.shape[0], *trailing))


def inverse_gains(calibration: Array, shape: tuple[int, ...], xp: Any = np) -> Array:
    """Return what moments of this shape are multiplied with: complex128, NaN where not finite.

    Raises
    ------
    ShapeError
        When the calibration is neither one number a plane nor of the moments' shape.
    """
    gain = as_array(calibration)
    if tuple(gain.shape) not in (shape[:1], shape):
        expected = f"of shape ({shape[0]},) or {shape}"
        raise ShapeError("calibration", f"of shape {tuple(gain.shape)}", expected)
    with np.errstate(all="ignore"):
        inverse = 1 / xp.asarray(gain).astype(xp.complex128)
        return xp.where(xp.isfinite(inverse), inverse, np.nan)


def calibration_of(moments: Array) -> Array:
    """Turn the moments of a calibration measurement into gains.

    Parameters
    ----------
    moments : array, shape (m + 1, ...)
        Measured with the source at the sensor, so that each should be b_0 (Sec. 4.2).

    Returns
    -------
    array, shape (m + 1, ...)
        moments / b_0: the brightness stays as it is when divided by it. NaN where b_0 is not
        positive.
    """
    planes, trailing = moment_planes(moments, name="moments")
    xp = namespace(planes)
    with np.errstate(all="ignore"):
        inverse = xp.where(planes[0].real > 0, 1 / planes[0].real, np.nan)
    return (planes * inverse.astype(planes.dtype)).reshape((planes.shape[0], *trailing))


def nominal_calibration(
    harmonics: int,
    sub_phases_rad: Sequence[float] = (0.0,),
    weights: Sequence[float] | None = None,
    *,
    zeroth: str,
) -> Array:
    """Return the gains that sub-phases alone give an ideal sinusoidal correlation.

    Parameters
    ----------
    harmonics : int
        m, 1 to 32.
    sub_phases_rad : sequence of float
        Phase offsets inside one exposure in radian.
    weights : sequence of float, optional
        Their shares of the exposure; equal when left out.
    zeroth : {"low-frequency", "on-off", "estimated"}
        How b_0 was measured. A low frequency goes through the same sub-phases, and b_0 is the
        modulus of its phasor; on and off don't.

    Returns
    -------
    array, shape (m + 1,), complex128
        Gain of b_0 .. b_m, to be given to `calibrate`.

    Raises
    ------
    ParameterError
        For another number of harmonics or way to measure b_0, or for weights that don't fit.
    """
    if not 1 <= harmonics <= MAX_HARMONICS:
        raise ParameterError("harmonics", harmonics, "1 to 32")
    chosen("zeroth", zeroth, ("low-frequency", "on-off", "estimated"))
    gain = complex(modulation_gain(1, sub_phases_rad, weights))
    first = abs(gain) if zeroth == "low-frequency" else 1.0
    return np.array([first] + [gain] * harmonics, dtype=np.complex128)
