"""Sinusoidal modulation from any modulation, by phase steps inside the exposure (Sec. 4.1)."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.errors import ParameterError


def modulation_gain(
    harmonic: Array, sub_phases_rad: Sequence[float] | Array, weights: Array | None = None
) -> Array:
    """Return the factor by which phase steps multiply a harmonic of the raw modulation.

    Parameters
    ----------
    harmonic : int or array of int
        k, any shape.
    sub_phases_rad : array, shape (n,)
        Phase steps p_l in radian.
    weights : array, shape (n,), optional
        Their weights w_l; equal when left out.

    Returns
    -------
    array, complex, shape of `harmonic`
        G_k = sum_l w_l exp(-i k p_l) / sum_l w_l.

    Raises
    ------
    ParameterError
        When there is no phase step, or the weights don't fit or don't have a positive sum.
    """
    phases = np.atleast_1d(np.asarray(sub_phases_rad, dtype=float))
    share = np.ones_like(phases) if weights is None else np.asarray(weights, dtype=float)
    if phases.ndim != 1 or phases.size == 0:
        raise ParameterError("sub_phases_rad", sub_phases_rad, "one axis with at least one phase")
    if share.shape != phases.shape or not share.sum() > 0:
        raise ParameterError("weights", weights, "one a sub-phase, with a positive sum")
    k = np.asarray(harmonic)
    return np.exp(-1j * k[..., None] * phases) @ (share / share.sum())
