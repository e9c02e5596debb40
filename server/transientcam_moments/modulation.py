"""Sinusoidal modulation from any modulation, by phase steps inside the exposure (Sec. 4.1)."""

import math
from collections.abc import Sequence

import numpy as np

from transientcam_moments._arrays import Array, as_array
from transientcam_moments.errors import ParameterError, ShapeError


def arccos_sub_phases(n: int) -> tuple[Array, Array]:
    """Return the phase steps of arccos sampling and their equal weights.

    Parameters
    ----------
    n : int
        Number of phase steps, >= 1; the paper's default is 8.

    Returns
    -------
    sub_phases_rad : array, shape (n,)
        arccos(1 - (2 l + 1) / n), Eq. (3).
    weights : array, shape (n,)
        Shares of the exposure, sum 1.
    """
    _positive("n", n)
    steps = np.arange(n)
    return np.arccos(1 - (2 * steps + 1) / n), np.full(n, 1 / n)


def harmonic_cancellation_sub_phases(n: int) -> tuple[Array, Array]:
    """Return the phase steps and weights that cancel odd harmonics up to 2 n - 1.

    Parameters
    ----------
    n : int
        Number of phase steps, >= 1; the paper's hardware is robust up to 3.

    Returns
    -------
    sub_phases_rad : array, shape (n,)
        l pi / (n + 1).
    weights : array, shape (n,)
        sin((l + 1) pi / (n + 1)), as shares of the exposure with sum 1 (Payne et al. 2010).
    """
    _positive("n", n)
    steps = np.arange(n)
    weights = np.sin((steps + 1) * np.pi / (n + 1))
    return steps * np.pi / (n + 1), weights / weights.sum()


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


def effective_modulation(
    waveform: Array, sub_phases_rad: Array, weights: Array | None = None
) -> Array:
    """Return the Fourier coefficients of a modulation sampled with phase steps.

    Parameters
    ----------
    waveform : array, shape (..., N)
        Raw modulation (or correlation function) over exactly one period, N samples.
    sub_phases_rad : array, shape (n,)
        Phase steps in radian.
    weights : array, shape (n,), optional
        Their weights; equal when left out.

    Returns
    -------
    array, shape (..., N // 2 + 1), complex
        Coefficient of exp(i k phi), k = 0 .. N // 2, in the waveform's unit.

    Raises
    ------
    ShapeError
        When there are fewer than 3 samples.
    ParameterError
        When phases and weights don't fit.
    """
    samples = as_array(waveform)
    if samples.ndim < 1 or samples.shape[-1] < 3:
        raise ShapeError("waveform", f"of shape {tuple(samples.shape)}", "at least 3 samples")
    harmonics = np.fft.rfft(np.asarray(samples), axis=-1) / samples.shape[-1]
    return harmonics * modulation_gain(np.arange(harmonics.shape[-1]), sub_phases_rad, weights)


def harmonic_distortion(harmonics: Array, *, four_bucket: bool = True) -> Array:
    """Return the total harmonic distortion: what is not the fundamental, relative to it.

    Parameters
    ----------
    harmonics : array, shape (..., K)
        Coefficients of harmonics 0 .. K - 1, from `effective_modulation`.
    four_bucket : bool
        Leave out even harmonics, which the difference of opposite images removes.

    Returns
    -------
    array, shape (...)
        sqrt(sum |c_k|^2) / |c_1| over k >= 2.
    """
    size = np.abs(np.asarray(harmonics))
    step = 2 if four_bucket else 1
    rest = size[..., 3::2] if step == 2 else size[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt((rest**2).sum(axis=-1)) / size[..., 1]


def _positive(field: str, value: int) -> None:
    if not 1 <= value < math.inf:
        raise ParameterError(field, value, ">= 1")
