"""The likelihood estimate of every pixel, with what it is worth."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from transientcam_compiled import Spread
from transientcam_moments._dispatch import accelerated, on_threads
from transientcam_moments.arrays import (
    MAX_HARMONICS,
    Array,
    as_array,
    by_blocks,
    in_range,
    moment_planes,
    namespace,
    summary,
)
from transientcam_moments.errors import ParameterError, ShapeError
from transientcam_moments.likelihood import _scaled as scaled
from transientcam_moments.likelihood._chi_square import SIGNIFICANCE, ambiguous, explained, reduced
from transientcam_moments.likelihood._choice import MOST_RETURNS, TAIL_SHAPES
from transientcam_moments.likelihood._planar import Data, fit
from transientcam_moments.moment_problem import DIRECT_THRESHOLD, Returns, Separation, separate
from transientcam_moments.noise import MomentNoise, free_of_scale

MODEL_ERROR, CORRECTED_ERROR = 4e-3, 2e-3
"""What calibration, and light of no model, leave in the moments of a camera, over the largest: as
large as the bias of Sec. 4.3, and where the harmonics of the modulation were measured and taken
out. docs/likelihood.md has the evidence."""


class Likelihood(NamedTuple):
    """Sharp returns, or a return and a tail that begins with it, by weighted least squares.

    Attributes
    ----------
    phase_rad : array, shape (K, ...)
        Of each return, in [0, 2 pi), ascending; NaN in unused slots, which come last. With a tail
        there is one.
    weight : array, shape (K, ...)
        Light of each return, >= 0, in the unit of the moments; 0 in unused slots.
    phase_std_rad, weight_std : array, shape (K, ...)
        Their standard deviations, from the information matrix of the model that was chosen; NaN
        in unused slots.
    tail, tail_std : array, shape (...)
        Light of the tail and its standard deviation; 0 and NaN where there is none.
    delay_rad, delay_std_rad : array, shape (...)
        Mean phase by which that light comes after the return; NaN without a tail. The prior is
        part of its standard deviation.
    chi_square : array, shape (...)
        Sum of squares of what is left of the moments, over their variances; NaN where there is
        no light or a measured moment is not finite.
    degrees_of_freedom : integer array, shape (...)
        How many more real numbers were measured than the model has unknowns.
    count : integer array, shape (...)
        Number of returns; 0 where there is no light or a measured moment is not finite.
    average_rad, average_std_rad : array, shape (...)
        Phase of the direct return and its standard deviation, averaged over models: by how well
        each explains the moments, the spread between them in the deviation. NaN without a return.
    tail_shape : integer array, shape (...)
        Shape p of the tail's gamma distribution; 0 without a tail.
    lead : array, shape (...)
        Of two returns by `two_returns`: by how much chi-square is larger with the best other pair
        that was found and has another direct return. Infinite where there is none, or none was
        looked for.
    threshold : float
        Of the direct return that was averaged.
    """

    phase_rad: Array
    weight: Array
    phase_std_rad: Array
    weight_std: Array
    tail: Array
    tail_std: Array
    delay_rad: Array
    delay_std_rad: Array
    chi_square: Array
    degrees_of_freedom: Array
    count: Array
    average_rad: Array
    average_std_rad: Array
    tail_shape: Array
    lead: Array
    threshold: float

    def __repr__(self) -> str:
        """State the shapes and spans of its arrays."""
        return summary(self)

    @property
    def has_tail(self) -> Array:
        """Where the model with a tail was chosen, and there is light in it."""
        return self.tail > 0

    @property
    def reduced_chi_square(self) -> Array:
        """Chi-square over its degrees of freedom; NaN where there are none."""
        return reduced(self.chi_square, self.degrees_of_freedom)

    def ambiguous(self, significance: float = SIGNIFICANCE) -> Array:
        """Say where another pair of returns may be the right one; as `Unwrapped.ambiguous`."""
        return ambiguous(self.lead, significance)

    def explained(self, significance: float = SIGNIFICANCE) -> Array:
        """Say where the model explains the moments.

        Parameters
        ----------
        significance : float
            Share of the pixels of which it is wrongly denied, 0 < significance < 1.

        Returns
        -------
        boolean array, shape (...)
            False where chi-square is above what noise alone exceeds with that probability, and
            where there is no light. Without degrees of freedom nothing can contradict the model.

        Raises
        ------
        ParameterError
            For a significance outside of 0 to 1.
        """
        return explained(self.chi_square, self.degrees_of_freedom, significance)

    def separate(self, threshold: float | None = None) -> Separation:
        """Separate direct from indirect light.

        Parameters
        ----------
        threshold : float, optional
            The direct return is the first whose weight is at least this share of the strongest
            one's, 0 to 1. The tail is indirect, however strong it is. That of the estimate, when
            left out: its phase is the average over models. With another threshold it is that of
            the model which was chosen.

        Raises
        ------
        ParameterError
            For a threshold outside of 0 to 1.
        """
        xp = namespace(self.weight)
        returns = Returns(self.phase_rad, self.weight, self.tail, self.count)
        at = self.threshold if threshold is None else threshold
        direct, indirect, phase = separate(returns, at)
        # a tail begins at its return, which may be too faint to be seen itself
        phase = xp.where(self.has_tail, self.phase_rad[0], phase)
        phase = self.average_rad if at == self.threshold else phase
        return Separation(direct, indirect + self.tail, phase)

    def direct_phase_std_rad(self, threshold: float | None = None) -> Array:
        """Return the standard deviation (...) of the phase that `separate` returns."""
        if threshold in (None, self.threshold):
            return self.average_std_rad
        xp = namespace(self.weight)
        direct = self.phase_rad == self.separate(threshold).phase_rad
        std = xp.where(direct, self.phase_std_rad, 0).sum(axis=0)
        return xp.where(direct.any(axis=0), std, np.nan).astype(self.weight.dtype)


def likelihood(
    b: Array,
    noise: MomentNoise | None = None,
    *,
    harmonics: Sequence[int] | None = None,
    returns: int = MOST_RETURNS,
    tail_shape: int | Sequence[int] = TAIL_SHAPES,
    model_error: float = 0.0,
    threshold: float = DIRECT_THRESHOLD,
    threads: int | None = None,
) -> Likelihood:
    """Estimate the returns of every pixel from moments whose noise is known.

    Parameters
    ----------
    b : array, shape (N, ...)
        Moments, calibrated, not biased.
    noise : MomentNoise, optional
        Of shape (N, ...) or (N,). Moments with a variance that is 0, infinite or NaN count as not
        measured, and may be anything: as b_0 of ``zeroth="estimated"``. When left out, every part
        of a moment has the standard deviation `noise.ASSUMED_NOISE` times the pixel's largest one,
        and all that is said of deviations and chi-square is relative to that.
    harmonics : sequence of int, optional
        Which multiples of the base frequency they are, N different ones of 0 to 32 in any order;
        0 to N - 1 when left out.
    returns : int
        Most sharp returns, 1 to 3.
    tail_shape : int or sequence of int
        Shape p of the tail's gamma distribution, 1 (exponential) to 6, or several of them, of which
        the first is tried first; 0 for no tail.
    model_error : float
        What is wrong with every part of a moment beside its noise, as calibration and the models
        leave it: a standard deviation over the pixel's largest moment, 0 to 1. It is part of all
        that is said of deviations and chi-square. `MODEL_ERROR` is a camera's.
    threshold : float
        Of `Likelihood.separate`, for the average over models.
    threads : int, optional
        How many the compiled kernel uses; all cores, when left out.

    Returns
    -------
    Likelihood
        With `returns` slots, or as many as the highest harmonic if that is less. Pixels without
        light or with a measured moment that is not finite have no return.

    Raises
    ------
    ShapeError
        When `b` is not 2 to 33 planes of numbers, or noise or harmonics don't fit it.
    ParameterError
        For other numbers of returns, shapes of tails, harmonics, model errors or thresholds, and
        for less than one thread.

    Notes
    -----
    Two kinds of models are fitted by weighted least squares, with all weights >= 0:
    b_j = sum_k w_k exp(i j phi_k) with K = 1 to 3 returns, and
    b_j = exp(i j phi) (w + v / (1 - i j d)^p), a return w with a tail v whose density is that of a
    gamma distribution, of mean delay p d; log(p d) has a normal prior with mean log 0.75 and
    standard deviation 1. The one with the least chi^2 + n_unknowns (log n_numbers + 6) is shown:
    the Bayesian information criterion with a margin (see `MARGIN`).

    The phase of the direct return is the mean over all of them, with the weights exp(-s / 2):
    s = chi^2 + n_unknowns log n_numbers, and 6 more for each component beside the first; tails of
    several shapes share one prior. That with p = 1 is fitted once more with w = 0, as of wax. The
    variance is the mean of theirs and what their phases spread.
    More than one return is tried where one leaves enough to explain, and shapes of tails beside the
    first one where that is not far worse than the best model.

    A fit begins with the returns of the one before and the best of 4 m + 6 phases for one more, the
    tail with two returns, further shapes with the first one. Where noise does not explain what they
    leave, two returns begin once more with one that is split, and three with that and with the
    brightest of Pisarenko's. One, two and three returns and a tail take at most 4, 8, 10 and 10 of
    Levenberg and Marquardt's steps, several returns that have not settled or begin once more up to
    60; none raises chi^2, with the weights eliminated (Golub and Pereyra 1973, Kaufman 1975),
    and no more where one changes chi^2 by too little to matter (`sharp.judge`). Noise
    smaller than the rounding of the moments' precision counts as that large.

    With b_0 measured, all light comes from returns and tail: a uniform part is not in the model.
    """
    spread = on_threads(threads)
    return fitted(b, noise, spread, harmonics, returns, tail_shape, model_error, threshold)


@free_of_scale
def fitted(
    b: Array,
    noise: MomentNoise,
    spread: Spread,
    harmonics: Sequence[int] | None = None,
    returns: int = MOST_RETURNS,
    tail_shape: int | Sequence[int] = TAIL_SHAPES,
    model_error: float = 0.0,
    threshold: float = DIRECT_THRESHOLD,
) -> Likelihood:
    """Do what `likelihood` does, with the threads of a caller."""
    planes, trailing = moment_planes(b)
    if not 1 <= returns <= MOST_RETURNS:
        raise ParameterError("returns", returns, f"1 to {MOST_RETURNS}")
    shapes = (tail_shape,) if isinstance(tail_shape, int) else tuple(tail_shape)
    if not all(0 <= shape <= 6 for shape in shapes) or len(set(shapes)) != len(shapes):
        raise ParameterError("tail_shape", tail_shape, "0 to 6, each once")
    shapes = tuple(shape for shape in shapes if shape)
    in_range("model_error", model_error, 0.0, 1.0, "0 to 1")
    in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
    planes, variance = dense(planes, noise, harmonics, trailing)
    options = returns, shapes, float(model_error), float(threshold)
    found = _estimated(planes, variance, *options, spread=spread)
    shaped = [part.reshape((*part.shape[:-1], *trailing)) for part in found]
    xp = namespace(planes)
    lead = xp.broadcast_to(xp.asarray(np.inf, dtype=shaped[0].dtype), trailing)
    return Likelihood._make([*shaped, lead, float(threshold)])


def dense(
    planes: Array, noise: MomentNoise, harmonics: Sequence[int] | None, trailing: tuple[int, ...]
) -> tuple[Array, Array]:
    """Return moments and variance (m + 1, P) with planes of zeros for what was not measured."""
    places = places_of(harmonics, planes.shape[0])
    variance = variance_of(noise, planes, trailing)
    xp = namespace(planes)
    order = max(places)
    if places != tuple(range(order + 1)):
        empty = xp.zeros_like(planes[0])
        by_place = dict(zip(places, range(len(places)), strict=True))
        place_of = [by_place.get(j) for j in range(order + 1)]
        planes = xp.stack([empty if at is None else planes[at] for at in place_of])
        variance = xp.stack(
            [xp.zeros_like(variance[0]) if at is None else variance[at] for at in place_of]
        )
    return planes, variance


def places_of(
    harmonics: Sequence[int] | None, count: int, most: int = MAX_HARMONICS
) -> tuple[int, ...]:
    """Return the multiple of each of `count` moments; raises as `likelihood`."""
    places = tuple(range(count)) if harmonics is None else tuple(int(each) for each in harmonics)
    if len(places) != count:
        raise ShapeError("harmonics", f"{len(places)} numbers", f"one for each of {count} moments")
    if len(set(places)) != count or not 0 <= min(places) <= max(places) <= most:
        raise ParameterError("harmonics", places, f"different ones of 0 to {most}")
    return places


def variance_of(noise: MomentNoise, planes: Array, trailing: tuple[int, ...]) -> Array:
    """Return the variance (N, P) of each part of the moments; raises as `likelihood`."""
    xp = namespace(planes)
    real = planes.real.dtype
    variance = as_array(noise.variance)
    shape = tuple(variance.shape)
    if shape not in ((planes.shape[0],), (planes.shape[0], *trailing)):
        expected = f"({planes.shape[0]},) or {(planes.shape[0], *trailing)}"
        raise ShapeError("noise", f"of shape {shape}", expected)
    flat = variance.reshape((planes.shape[0], -1))
    return xp.broadcast_to(xp.asarray(flat).astype(real), planes.shape)


@accelerated("likelihood")
def _estimated(planes: Array, variance: Array, *options: Any) -> tuple[Array, ...]:
    """Return the attributes of `Likelihood` of flat planes, but for `lead` and `threshold`."""
    return by_blocks(lambda b, variance: _estimate(b, variance, *options), planes, variance)


def _estimate(
    b: Array, variance: Array, returns: int, shapes: tuple[int, ...], error: float, threshold: float
) -> tuple[Array, ...]:
    """Planar statement of `likelihood`: all harmonics from 0 on, (m + 1, P)."""
    with np.errstate(all="ignore"):  # invalid pixels are computed along and stay by themselves
        data, scale, usable = prepared(b, variance, error)
        found = fit(data, returns, shapes, threshold)
        return results(found, data, scale, usable, min(returns, b.shape[0] - 1))


def prepared(b: Array, variance: Array, error: float) -> tuple[Data, Array, Array]:
    """Return data with the largest moment 1, what divided them, and where there is light."""
    re, im, weight = (list(part) for part in (b.real, b.imag, variance.astype(b.real.dtype)))
    one = namespace(b).ones_like(weight[0])
    order = (0,) * (len(re) - 1)
    scale, numbers, penalty, usable = scaled.prepare(order, error, one, re, im, weight)
    return Data(re, im, weight, penalty, numbers), scale, usable


def results(
    found: list[Array], data: Data, scale: Array, usable: Array, slots: int
) -> tuple[Array, ...]:
    """Return the attributes of `Likelihood` of what was found, but for `lead` and `threshold`."""
    out = [scale] * scaled.rows(slots)
    scaled.attributes((0,) * slots, found, scale, data.numbers, usable, out)
    return scaled.arranged(out, slots)
