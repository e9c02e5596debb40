"""The phase sweep of a calibration: images at phases between the four, and what they show.

A correlation of odd harmonics and a constant o has the value 2 o in the sum of any two opposite
images, so that half of the images of a sweep follow from the others and from its takes. That finds
the images that lost their synchronisation (Sec. 6), which two takes of three may have done.
"""

from typing import NamedTuple

import numpy as np

from transientcam_moments.arrays import Array, as_array
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.images._four_bucket import measure
from transientcam_moments.images._pair_sums import PHASE_STEPS

_OUTLIER = 8.0  # times the median difference from the series: 5.4 standard deviations
_ROUNDING = 1e-9  # of the largest mean


class SweepPhasors(NamedTuple):
    """Four-bucket phasors of a phase sweep.

    Attributes
    ----------
    phasors : array, shape (Q, m, P), complex
        Of each step; NaN where no take of an image nor of the opposite one was kept.
    left_out : boolean array, shape (Q, takes, 4 m)
        Images that lost their synchronisation.
    """

    phasors: Array
    left_out: Array


def sweep_offsets_rad(steps: int) -> Array:
    """Return what a phase sweep of so many steps adds to the four phases: a quarter turn evenly.

    Q steps separate the harmonics below 2 Q from each other.
    """
    return np.arange(steps) * (np.pi / (2 * steps))


def sweep_phasors(images: Array) -> SweepPhasors:
    """Average the takes of a phase sweep without the images that lost their synchronisation.

    Parameters
    ----------
    images : array, shape (Q, takes, 4 m, P)
        Of b_1 .. b_m at each of `sweep_offsets_rad(Q)`, NumPy array of real numbers; pixels that
        see a single return through filter and diffuser, none of them saturated.

    Returns
    -------
    SweepPhasors

    Raises
    ------
    ShapeError
        For other axes, no pixel, or a number of images that is no multiple of four.

    Notes
    -----
    Light and sensor fall out of step for the whole sensor, which shows in the mean of an image.
    Means of all takes are fitted by a constant and the odd harmonics below 2 Q; the one that is
    farthest off is left out, until none is, and then what no other image confirms. An image left
    out in all takes is 2 o less the opposite image.
    """
    images = np.asarray(images)
    if images.ndim != 4 or images.shape[2] % PHASE_STEPS or not images.size:
        raise ShapeError("images", f"of shape {images.shape}", "(Q, takes, 4 m, P)")
    steps, takes, count, pixels = images.shape
    series = _odd_series(steps)
    by_frequency = (steps, takes, count // PHASE_STEPS, PHASE_STEPS)
    means = images.mean(axis=3, dtype=np.float64).reshape(by_frequency)
    left_out = np.stack([_outliers(each, series) for each in np.moveaxis(means, 2, 0)], axis=2)
    left_out = left_out.reshape((steps, takes, count))
    total = np.zeros((steps, count, pixels), np.float32)
    for take in range(takes):
        total += np.where(left_out[:, take, :, None], 0, images[:, take])
    with np.errstate(invalid="ignore"):
        average = total / (~left_out).sum(axis=1)[:, :, None].astype(np.float32)
    _fill(average.reshape((steps, count // PHASE_STEPS, PHASE_STEPS, pixels)))
    phasors = np.stack([measure(step, zeroth="estimated")[1:] for step in average])
    return SweepPhasors(phasors, left_out)


def waveform_of(phasors: Array, count: int) -> Array:
    """Return the odd harmonics of the correlation from a phase sweep.

    Parameters
    ----------
    phasors : array, shape (Q, m, P)
        Four-bucket phasors of b_1 .. b_m at each of `sweep_offsets_rad(Q)`, of pixels that see
        a single return at phase zero, through filter and diffuser.
    count : int
        How many harmonics; 3, 5, .. 2 count + 1 must be below 2 Q.

    Returns
    -------
    array, shape (m, count), complex128
        c_3 / c_1, c_5 / c_1, ..., where time zero is where the fundamental peaks; NaN for a
        frequency without light. All pixels share them, each with its own phase, and
        weigh by the square of their fundamental.

    Raises
    ------
    ShapeError
        For other than three axes.
    ParameterError
        When the sweep has too few steps for that many harmonics.

    Notes
    -----
    At offset d, equation (1) of `harmonics` reads a_j(d) = sum over n = 1, -3, 5, -7, ... of
    C_n exp(-i n d), a Fourier series in 4 d whose coefficient of n is c_n u^n, or
    conj(c_k u^k), k = -n, for n < 0.
    """
    phasors = as_array(phasors)
    if phasors.ndim != 3:
        raise ShapeError("phasors", f"of shape {tuple(phasors.shape)}", "(Q, m, P)")
    steps = phasors.shape[0]
    if not 0 <= count < steps:
        raise ParameterError("count", count, f"0 to {steps - 1} with {steps} steps")
    offset_rad = sweep_offsets_rad(steps)

    def coefficient(n: int) -> Array:
        turn = np.exp(1j * n * offset_rad) / steps
        return np.tensordot(turn, phasors.astype(np.complex128), axes=1)

    first = coefficient(1)
    size = np.abs(first)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.conj(first) / np.where(size > 0, size, 1)
        weight = (size**2).sum(axis=-1)
        columns = []
        for k in odd_orders(count):
            found = coefficient(k) if k % 4 == 1 else np.conj(coefficient(-k))
            columns.append((found * turn**k * size).sum(axis=-1) / np.where(weight > 0, weight, 0))
    return np.stack(columns, axis=-1) if columns else np.empty((phasors.shape[1], 0), complex)


def odd_orders(count: int) -> range:
    """Return the orders of so many harmonics: 3, 5, ..."""
    return range(3, 2 * count + 3, 2)


def _odd_series(steps: int) -> Array:
    """Return a constant and the odd harmonics below 2 Q at the phases (4 Q) of a sweep."""
    phase_rad = sweep_offsets_rad(steps)[:, None] + np.arange(PHASE_STEPS) * (np.pi / 2)
    turns = phase_rad.reshape((-1, 1)) * np.arange(1, 2 * steps, 2)
    return np.concatenate([np.ones((len(turns), 1)), np.cos(turns), np.sin(turns)], axis=1)


def _outliers(means: Array, series: Array) -> Array:
    """Return which means (Q, takes, 4) of the images at one frequency do not fit a series."""
    steps, takes, phases = means.shape
    values = means.transpose((1, 0, 2)).reshape(-1)
    rows = np.tile(series, (takes, 1))
    kept = np.arange(len(values))
    rounding = _ROUNDING * float(np.abs(values).max())
    while True:
        basis, _ = np.linalg.qr(rows[kept])
        left = np.abs(values[kept] - basis @ (basis.T @ values[kept]))
        free = 1 - (basis**2).sum(axis=1)  # share of a mean that the others confirm
        spread = np.sqrt(np.maximum(free, _ROUNDING))
        worst = int(np.argmax(left / spread))
        if left[worst] <= spread[worst] * (_OUTLIER * float(np.median(left)) + rounding):
            break
        kept = np.delete(kept, worst)
    kept = kept[free > _ROUNDING]
    outlying = np.ones(len(values), bool)
    outlying[kept] = False
    return outlying.reshape((takes, steps, phases)).transpose((1, 0, 2))


def _fill(average: Array) -> None:
    """Replace images (Q, m, 4, P) that are NaN by 2 o less the opposite ones, in place."""
    missing = np.isnan(average[..., 0])  # (Q, m, 4)
    half = PHASE_STEPS // 2
    for frequency in np.flatnonzero(missing.any(axis=(0, 2))):
        part = average[:, frequency]
        sums = part[:, :half] + part[:, half:]
        total = np.nanmean(sums, axis=(0, 1))
        for step, phase in np.argwhere(missing[:, frequency]):
            part[step, phase] = total - part[step, (phase + half) % PHASE_STEPS]
