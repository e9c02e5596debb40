"""Broadband coded modulation: a code's correlation at many shifts, deconvolved into returns."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from transientcam_moments.arrays import Array, flat_planes, in_range
from transientcam_moments.comparisons._estimate import Real, SparseEstimate
from transientcam_moments.comparisons._grid import cluster, stacked
from transientcam_moments.comparisons._pixels import Complex, Pixels
from transientcam_moments.comparisons._technique import TEXTS, Technique
from transientcam_moments.errors import ParameterError, ShapeError

BITS = 5
"""A code of 2^5 - 1 = 31 chips."""
BINS = 496
_LOBES = 3  # of the chips' spectrum that count as the code's bandwidth


@dataclass(frozen=True, slots=True, eq=False)
class Code:
    """The correlation of a periodic code of light with that of the sensor.

    Attributes
    ----------
    contents : array, shape (K), complex
        Of its harmonics 1 .. K: R(phi) = Re sum_k contents_k exp(i k phi). A constant part
        has no information on time and is left out.
    """

    contents: Complex

    def correlation(self, phase_rad: ArrayLike) -> Real:
        """Return R at phases (...)."""
        phase = np.asarray(phase_rad, float)
        orders = np.arange(1, len(self.contents) + 1)
        series: Real = (np.exp(1j * phase[..., None] * orders) @ self.contents).real
        return series

    def sample(
        self,
        phase_rad: ArrayLike,
        weight: ArrayLike,
        *,
        shifts_rad: ArrayLike,
        harmonics: ArrayLike = 1,
    ) -> Real:
        """Return what a camera would measure of returns, without noise.

        Parameters
        ----------
        phase_rad, weight : array, shape (K, ...)
            Of the returns; a finely divided density is many returns.
        shifts_rad : array, shape (N)
            Of the sensor's code, one a sample.
        harmonics : int or integer array, shape (N)
            Multiples of the base frequency that the code is repeated with.

        Returns
        -------
        array, shape (N, ...)
            sum_k w_k R(j phi_k - theta).
        """
        phase, light = np.asarray(phase_rad, float), np.asarray(weight, float)
        shifts, orders = np.broadcast_arrays(np.asarray(shifts_rad, float), harmonics)
        return np.stack(
            [
                (light * self.correlation(order * phase - shift)).sum(axis=0)
                for shift, order in zip(shifts.ravel(), orders.ravel(), strict=True)
            ]
        )


@lru_cache(maxsize=8)
def maximum_length_code(bits: int = BITS) -> Code:
    """Return the code of a maximum length sequence of 2^bits - 1 chips, 2 <= bits <= 10.

    Its correlation is a triangle as wide as two chips.

    Raises
    ------
    ParameterError
        For another number of bits.
    """
    if not 2 <= bits <= 10:
        raise ParameterError("bits", bits, "2 to 10")
    from scipy.signal import max_len_seq  # heavy, and not needed by those who don't compare

    chips = 2.0 * max_len_seq(bits)[0] - 1
    length = len(chips)
    orders = np.arange(1, _LOBES * length + 1)
    power = np.abs(np.fft.fft(chips)[orders % length] / length) ** 2
    return Code(2 * power * np.sinc(orders / length) ** 2 + 0j)


def equal_shifts_rad(samples: int) -> Real:
    """Return equidistant shifts (N) around the turn."""
    return np.arange(samples) * (2 * np.pi / samples)


def coded(
    samples: Array,
    *,
    code: Code | None = None,
    shifts_rad: ArrayLike | None = None,
    harmonics: ArrayLike = 1,
    sparsity: float = 0.1,
    bins: int = BINS,
) -> SparseEstimate:
    """Deconvolve samples of a code's correlation into returns, pixel by pixel.

    Parameters
    ----------
    samples : array, shape (N, ...)
        Real, without the constant part of the correlation.
    code : Code, optional
        That of 31 chips, when left out.
    shifts_rad : array, shape (N), optional
        Of the code, equidistant around the turn when left out.
    harmonics : int or integer array, shape (N)
        Multiples of the base frequency that the code was repeated with.
    sparsity : float
        Punishes light by the square of its sum, relative to what a return gives; >= 0.
    bins : int
        Phases k 2 pi / bins that light may come back at.

    Raises
    ------
    ShapeError
        When the samples are not real, or shifts and samples are not equally many.
    ParameterError
        For another `sparsity`.

    Notes
    -----
    Non-negative least squares over shifted copies of the correlation, by SciPy's NNLS, which is
    sparse of itself; the row of `sparsity` makes it prefer few. Between two shifts the correlation
    is straight, so that light closer than one shift is one return, at its centroid.
    """
    in_range("sparsity", sparsity, 0.0, float(np.finfo(float).max), ">= 0 and finite")
    pixels = _pixels(samples)
    y = pixels.b.real
    shifts = equal_shifts_rad(len(y)) if shifts_rad is None else np.asarray(shifts_rad, float)
    if shifts.shape != (len(y),):
        raise ShapeError("shifts_rad", f"of shape {shifts.shape}", f"of shape ({len(y)},)")
    copies = _dictionary(code or maximum_length_code(), shifts, harmonics, bins)
    size = float(np.linalg.norm(copies, axis=0).max())
    rows = np.concatenate([copies / size, np.full((1, bins), sparsity)])
    gap = bins // (len(y) * int(np.max(harmonics)))
    found: list[tuple[Real, Real] | None] = []
    for pixel, usable in enumerate(pixels.usable):
        light = _solved(rows, np.append(y[:, pixel], 0.0)) if usable else None
        found.append(cluster(light, gap=gap))
    phase, weight = stacked(found)
    return pixels.sparse(phase, weight / size)


def _solved(rows: Real, right: Real) -> Real | None:
    from scipy.optimize import nnls  # heavy, and not needed by those who don't compare

    try:
        light: Real = nnls(rows, right)[0]
    except RuntimeError:  # too many iterations
        return None
    return light


def _dictionary(code: Code, shifts: Real, harmonics: ArrayLike, bins: int) -> Real:
    grid = np.arange(bins) * (2 * np.pi / bins)
    return code.sample(
        np.broadcast_to(grid, (1, bins)),
        np.ones((1, bins)),
        shifts_rad=shifts,
        harmonics=np.broadcast_to(harmonics, shifts.shape),
    )


def _pixels(samples: Array) -> Pixels:
    """Prepare samples (N, ...) as other techniques' moments are."""
    array = np.asarray(samples)
    if array.ndim < 1 or array.shape[0] < 2 or array.dtype.kind not in "iuf":
        found = f"of shape {array.shape} and type {array.dtype}"
        raise ShapeError("samples", found, "real planes, two or more, first")
    wide = flat_planes(array.astype(float))
    scale = np.abs(wide).max(axis=0)
    usable: NDArray[np.bool_] = np.isfinite(scale) & (scale > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = np.where(usable, wide / scale, 0)
    dtype = np.float32 if array.dtype == np.float32 else np.float64
    return Pixels(scaled + 0j, usable, np.where(usable, scale, 0), array.shape[1:], dtype)


TECHNIQUE = Technique(
    **TEXTS["coded"],
    harmonics=lambda m: (1,),
    least_harmonics=1,
    estimate=coded,
    measures="code",
    planar=False,
)
