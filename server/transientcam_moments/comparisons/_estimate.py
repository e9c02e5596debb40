"""Impulse responses as techniques give them: returns, or light over a grid of phases."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from transientcam_moments.arrays import flat_planes, in_range
from transientcam_moments.likelihood import Likelihood
from transientcam_moments.moment_problem import (
    DIRECT_THRESHOLD,
    Coefficients,
    Returns,
    Separation,
    cumulative,
    peaks,
    separate,
)

Real = NDArray[np.floating[Any]]
GRID_PHASES = 256
_FULL_TURN = 2 * np.pi
_BLOCK_VALUES = 1 << 20
_TAIL_TURNS = 8


class Estimate(ABC):
    """An impulse response of every pixel, in the unit of the moments, over one turn of phase."""

    @abstractmethod
    def cumulative(self, phase_rad: ArrayLike) -> Real:
        """Return the light (T, ...) that has come back until phases (T,); any turn, 0 at 0."""

    @abstractmethod
    def separate(self, threshold: float = DIRECT_THRESHOLD) -> Separation:
        """Separate the first return from all later ones; see `transientcam_moments.separate`."""

    def first_phase_rad(self, threshold: float = DIRECT_THRESHOLD) -> Real:
        """Return the phase (...) of the first return, or peak, of a share of the strongest one's.

        In [0, 2 pi); NaN where there is none.
        """
        phase: Real = self.separate(threshold).phase_rad
        return phase


@dataclass(frozen=True, slots=True)
class SparseEstimate(Estimate):
    """Sharp returns and a uniform part.

    Attributes
    ----------
    phase_rad : array, shape (K, ...)
        In [0, 2 pi), ascending; NaN in unused slots, which come last.
    weight : array, shape (K, ...)
        Light of each return; 0 in unused slots.
    uniform : array, shape (...)
        Light spread evenly over the turn; 0 where the technique knows nothing of it.
    """

    phase_rad: Real
    weight: Real
    uniform: Real

    def cumulative(self, phase_rad: ArrayLike) -> Real:
        """Return the light (T, ...) that has come back until phases (T,)."""
        turns, within = _turns(phase_rad)
        total = self.weight.sum(axis=0)
        come = np.empty((len(within), *total.shape), total.dtype)
        for index, (turn, phase) in enumerate(zip(turns, within, strict=True)):
            # NaN is later than everything
            came = np.where(self.phase_rad <= phase, self.weight, 0).sum(axis=0)
            come[index] = came + turn * total + (turn + phase / _FULL_TURN) * self.uniform
        return come

    def separate(self, threshold: float = DIRECT_THRESHOLD) -> Separation:
        """Separate the first return from all later ones."""
        count = np.count_nonzero(self.weight, axis=0)
        return separate(Returns(self.phase_rad, self.weight, self.uniform, count), threshold)


@dataclass(frozen=True, slots=True)
class GridEstimate(Estimate):
    """Light over equal bins of phase.

    Attributes
    ----------
    density : array, shape (T, ...)
        Per radian, at the middle of each of T bins, which together are the turn. A technique
        without positivity leaves negative values in it.
    """

    density: Real

    @property
    def phase_rad(self) -> Real:
        """Middles (T,) of the bins."""
        return grid_rad(self.density.shape[0])

    def cumulative(self, phase_rad: ArrayLike) -> Real:
        """Return the light (T, ...) that has come back until phases (T,)."""
        turns, within = _turns(phase_rad)
        bins = self.density.shape[0]
        edges = np.concatenate([np.zeros_like(self.density[:1]), np.cumsum(self.density, axis=0)])
        place = within * (bins / _FULL_TURN)
        low = np.minimum(place.astype(int), bins - 1)
        share = _over_pixels(place - low, self.density.ndim)
        come = edges[low] * (1 - share) + edges[low + 1] * share
        come += _over_pixels(turns, self.density.ndim) * edges[-1]
        result: Real = (come * (_FULL_TURN / bins)).astype(self.density.dtype)
        return result

    def separate(self, threshold: float = DIRECT_THRESHOLD) -> Separation:
        """Separate the light of the first peak, from valley to valley, from all other light.

        A peak is a local maximum around the turn; its phase is that of the parabola through it and
        its neighbours.
        """
        in_range("threshold", threshold, 0.0, 1.0, "0 to 1")
        trailing = self.density.shape[1:]
        flat = flat_planes(self.density)
        result = tuple(np.empty(flat.shape[1], flat.dtype) for _ in range(3))
        pixels = max(1, _BLOCK_VALUES // flat.shape[0])
        for start in range(0, flat.shape[1], pixels):
            part = slice(start, start + pixels)
            for out, value in zip(result, _first_peak(flat[:, part], threshold), strict=True):
                out[part] = value
        direct, indirect, phase = (out.reshape(trailing) for out in result)
        return Separation(direct, indirect, phase)


@dataclass(frozen=True, slots=True)
class MaximumEntropyEstimate(Estimate):
    """The density of Eq. (2), by its coefficients."""

    coefficients: Coefficients

    def cumulative(self, phase_rad: ArrayLike) -> Real:
        """Return the light (T, ...) that has come back until phases (T,), in closed form."""
        come: Real = cumulative(self.coefficients, np.asarray(phase_rad, float).reshape(-1))
        return come

    def separate(self, threshold: float = DIRECT_THRESHOLD) -> Separation:
        """Separate the light of the first peak, from valley to valley, from all other light."""
        edges = np.arange(GRID_PHASES + 1) * (_FULL_TURN / GRID_PHASES)
        light = np.diff(self.cumulative(edges), axis=0)  # in bins: peaks may be sharper than them
        found = GridEstimate(light * (GRID_PHASES / _FULL_TURN)).separate(threshold)
        phase = self.first_phase_rad(threshold)
        return Separation(found.direct, found.indirect, phase)

    def first_phase_rad(self, threshold: float = DIRECT_THRESHOLD) -> Real:
        """Return the phase (...) of the first local maximum above the threshold (Sec. 5.3)."""
        phase: Real = peaks(self.coefficients, threshold=threshold).first_rad
        return phase


@dataclass(frozen=True, slots=True)
class LikelihoodEstimate(Estimate):
    """Sharp returns, or one with a gamma-shaped tail, by weighted least squares."""

    likelihood: Likelihood

    def cumulative(self, phase_rad: ArrayLike) -> Real:
        """Return the light (T, ...) that has come back until phases (T,); a tail goes around."""
        found = self.likelihood
        sharp = SparseEstimate(found.phase_rad, found.weight, np.zeros_like(found.tail))
        phase = np.asarray(phase_rad, float).reshape(-1)
        come = sharp.cumulative(phase)
        tailed = found.has_tail
        delay = np.where(tailed, found.delay_rad, 1)
        start = np.where(tailed, found.phase_rad[0], 0)
        for index, at in enumerate(phase):
            late = gamma_share((at - start) / delay, found.tail_shape)
            # what is still on its way at the end of a turn comes in the next one
            for turn in range(1, _TAIL_TURNS):
                shifted = (at - start + turn * _FULL_TURN) / delay
                late = late + gamma_share(shifted, found.tail_shape)
                late = late - gamma_share((turn * _FULL_TURN - start) / delay, found.tail_shape)
            come[index] += np.where(tailed, found.tail * late, 0)
        return come

    def separate(self, threshold: float = DIRECT_THRESHOLD) -> Separation:
        """Separate the first return from all later light."""
        return self.likelihood.separate(threshold)


def gamma_share(time: Real, shape: ArrayLike) -> Real:
    """Return the share of a gamma distribution of mean 1 until `time`, for whole shapes."""
    y = np.maximum(time, 0) * np.asarray(shape)
    rest, term = np.zeros(np.shape(y)), np.ones(np.shape(y))
    for k in range(int(np.max(shape, initial=0))):
        rest = rest + np.where(k < np.asarray(shape), term, 0)
        term = term * y / (k + 1)
    share: Real = 1 - rest * np.exp(-y)
    return share


def grid_rad(bins: int) -> Real:
    """Return the middles of equal bins of a turn, in radian."""
    return (np.arange(bins) + 0.5) * (_FULL_TURN / bins)


def _turns(phase_rad: ArrayLike) -> tuple[Real, Real]:
    """Split phases into whole turns and the rest; a positive full turn is a rest, not a turn."""
    phase = np.asarray(phase_rad, float).reshape(-1)
    turns = np.floor(phase / _FULL_TURN)
    ended = (phase == turns * _FULL_TURN) & (turns > 0)
    turns = np.where(ended, turns - 1, turns)
    return turns, np.clip(phase - turns * _FULL_TURN, 0, _FULL_TURN)


def _over_pixels(values: Real, axes: int) -> Real:
    return values.reshape((-1,) + (1,) * (axes - 1))


def _first_peak(heights: Real, threshold: float) -> tuple[Real, Real, Real]:
    """Return direct, indirect and phase of pixels (T, P)."""
    bins, columns = heights.shape[0], np.arange(heights.shape[1])
    before, after = np.roll(heights, 1, axis=0), np.roll(heights, -1, axis=0)
    with np.errstate(invalid="ignore"):
        enough = (heights > 0) & (heights >= threshold * heights.max(axis=0))
        at_peak = enough & (heights > before) & (heights >= after)
        at_valley = (heights <= before) & (heights < after)
    first = at_peak.argmax(axis=0)
    found = at_peak.any(axis=0)
    # from the valley before the peak to the one after it, around the turn
    around = (first + np.arange(bins)[:, None]) % bins
    valleys = at_valley[around, columns]
    forward = np.where(valleys.any(axis=0), valleys.argmax(axis=0), bins)
    backward = np.where(valleys.any(axis=0), valleys[::-1].argmax(axis=0) + 1, 0)
    steps = np.arange(bins)[:, None]
    near = (steps < forward) | (steps >= bins - backward)
    width = _FULL_TURN / bins
    direct = np.where(near, heights[around, columns], 0).sum(axis=0) * width
    total = heights.sum(axis=0) * width
    left, top, right = before[first, columns], heights[first, columns], after[first, columns]
    bend = left - 2 * top + right
    with np.errstate(invalid="ignore", divide="ignore"):
        offset = np.where(bend < 0, 0.5 * (left - right) / bend, 0)
    phase = np.remainder((first + 0.5 + offset) * width, _FULL_TURN)
    return (
        np.where(found, direct, 0),
        np.where(found, np.maximum(total - direct, 0), 0),
        np.where(found, phase, np.nan),
    )
