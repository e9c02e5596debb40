"""Roots of many small polynomials at once, by simultaneous iteration after Ehrlich and Aberth."""

import numpy as np

from transientcam_moments.arrays import Array, parts, to_complex
from transientcam_moments.moment_problem import _maxima as maxima


def disc_roots(a: Array) -> list[Array]:
    """Find the roots of z^m + a_1 z^{m-1} + ... + a_m: the poles of a maximum entropy density.

    Parameters
    ----------
    a : complex array, shape (m + 1, P)
        a_0 = 1, a_1 .. a_m of predictor polynomials; all roots lie inside the unit circle.

    Returns
    -------
    list of m complex planes
    """
    order = (0,) * (a.shape[0] - 1)
    re, im = parts(a)
    with np.errstate(all="ignore"):
        real, imag = maxima.poles(order, maxima.start_angles(len(order), re[0].dtype), re, im)
    return [to_complex(x, y) for x, y in zip(real, imag, strict=True)]
