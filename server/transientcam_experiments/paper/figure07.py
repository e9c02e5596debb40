"""Figure 7: sharp bounds on every smoothed density with the same moments (Sec. 5.2)."""

from dataclasses import replace
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.synthetic import CONTINUOUS, Response

_M: Final = 5
_F_HZ: Final = 23e6
_RADIUS: Final = 0.93
_RING: Final = 4096
_WIDTHS: Final = ("mean width over mean density", "greatest width over highest bound")


def make(bench: Bench) -> FigureResult:
    """Bound the smoothed density of the continuous response of Fig. 11b."""
    b = CONTINUOUS.moments(_F_HZ, _M)
    phase = 2 * np.pi * np.arange(_RING) / _RING
    lower, upper = (each[:, 0] for each in tm.bounds(b[:, None], phase, _RADIUS))
    smoothed = candidates(b, phase, bench.few(40, 5), np.random.default_rng(bench.seed))
    widths = [(m, *_width(CONTINUOUS, m, phase)) for m in (3, 4, 5, 6, 8)]
    sharper = [
        (scale, *_width(_sharper(scale), _M, phase)) for scale in (1.0, 0.5, 0.25, 0.125, 0.0625)
    ]
    return FigureResult(
        _draw(b, phase, lower, upper, smoothed),
        _statements(phase, lower, upper, smoothed, widths),
        (
            Table("Bounds on the continuous response", ("m", *_WIDTHS), widths),
            Table(
                "Bounds where every return is narrower, m = 5",
                ("widths and decays times", *_WIDTHS),
                sharper,
            ),
        ),
    )


def _sharper(scale: float) -> Response:
    """Return the continuous response with narrower returns."""
    returns = (
        replace(each, width_s=scale * each.width_s, decay_s=scale * each.decay_s)
        for each in CONTINUOUS.returns
    )
    return replace(CONTINUOUS, returns=tuple(returns))


def _width(response: Response, m: int, phase: Array) -> tuple[float, float]:
    b = response.moments(_F_HZ, m)[:, None]
    lower, upper = tm.bounds(b, phase, _RADIUS)
    width = upper - lower
    mean = response.brightness / (2 * np.pi)
    return float(width.mean() / mean), float(width.max() / upper.max())


def _truth(phase: Array) -> Array:
    """Return the true density over phase, per radian."""
    turn = 2 * np.pi * _F_HZ
    return CONTINUOUS.density(phase / turn) / turn


def candidates(b: Array, phase: Array, several: int, rng: np.random.Generator) -> Array:
    """Return smoothed densities (N, T) that share all moments: the truth, the estimates, others.

    A positive measure for b less a small positive one exists where the matrix stays positive:
    returns at random phases are taken from the moments, the rest is Pisarenko's, and both are
    smoothed as sums of kernels.
    """
    found = [
        _smooth(_truth(phase)),
        tm.smoothed_density(tm.levinson(b[:, None]), phase, _RADIUS)[:, 0],
    ]
    found.append(_returns(b, phase))
    while len(found) < 3 + several:
        at = rng.uniform(0, 2 * np.pi)
        steering = np.exp(1j * at * np.arange(b.size))
        # the most that can be taken at a phase: 1 / (s* B^-1 s)
        matrix = _toeplitz(b)
        most = 1 / (steering.conj() @ np.linalg.solve(matrix, steering)).real
        weight = rng.uniform(0.2, 0.95) * most
        rest = _returns(b - weight * steering, phase)
        found.append(rest + weight * _kernel(phase - at))
    return np.array(found)


def _returns(b: Array, phase: Array) -> Array:
    """Return the smoothed Pisarenko estimate: kernels at its returns, and its uniform part."""
    returns = tm.pisarenko(b[:, None])
    smoothed: Array = np.full(phase.shape, returns.uniform[0] / (2 * np.pi))
    for at, weight in zip(returns.phase_rad[:, 0], returns.weight[:, 0], strict=True):
        if weight > 0:
            smoothed = smoothed + weight * _kernel(phase - at)
    return smoothed


def _toeplitz(b: Array) -> Array:
    j = np.arange(b.size)
    both = np.concatenate([b[:0:-1].conj(), b])
    matrix: Array = both[j[:, None] - j[None] + b.size - 1]
    return matrix


def _kernel(phase: Array) -> Array:
    """Poisson's kernel."""
    kernel: Array = (1 - _RADIUS**2) / (2 * np.pi * np.abs(1 - _RADIUS * np.exp(1j * phase)) ** 2)
    return kernel


def _smooth(density: Array) -> Array:
    """Convolve with Poisson's kernel: harmonic k is multiplied by r^|k|."""
    spectrum = np.fft.rfft(density)
    smoothed: Array = np.fft.irfft(spectrum * _RADIUS ** np.arange(spectrum.size), density.size)
    return smoothed


def must_peak(phase: Array, lower: Array, upper: Array) -> tuple[float, float]:
    """Return where a maximum must be: what is compatible is lower on both sides."""
    top = int(lower.argmax())
    below = upper < lower[top]
    before, after = np.flatnonzero(below[:top]), np.flatnonzero(below[top:])
    if not before.size or not after.size:
        return 0.0, 2 * np.pi
    return float(phase[before[-1]]), float(phase[top + after[0]])


def _outside(smoothed: Array, lower: Array, upper: Array) -> float:
    """Return how far densities leave the bounds, over the highest bound."""
    return float(np.maximum(lower - smoothed, smoothed - upper).max() / upper.max())


def _statements(
    phase: Array,
    lower: Array,
    upper: Array,
    smoothed: Array,
    widths: list[tuple[int, float, float]],
) -> list[Statement]:
    truth = smoothed[0]
    begin, end = must_peak(phase, lower, upper)
    slack = 1e-6  # of the density's wrapped tail
    of_five = {m: greatest for m, _, greatest in widths}[_M]
    return [
        state("07.truth", _outside(truth[None], lower, upper), at_most=slack),
        state("07.ours", _outside(smoothed[1:2], lower, upper), at_most=slack),
        state(
            "07.others",
            _outside(smoothed[2:], lower, upper),
            at_most=slack,
            others=len(smoothed) - 2,
        ),
        state(
            "07.sharp", float(np.minimum(smoothed - lower, upper - smoothed).min() / upper.max())
        ),
        state("07.small", of_five),
        state(
            "07.maxima",
            (end - begin) / (2 * np.pi / _M),
            true_rad=float(phase[truth.argmax()]),
            begin=begin,
            end=end,
        ),
    ]


def _draw(b: Array, phase: Array, lower: Array, upper: Array, smoothed: Array) -> Any:
    with style.new(11.0, 3.8) as picture:
        left, right = picture.subplots(1, 2)
        left.plot(
            phase,
            _truth(phase),
            color=style.TRUTH,
            linestyle=":",
            linewidth=2.2,
            label="ground truth",
        )
        left.plot(
            phase,
            tm.density(tm.levinson(b[:, None]), phase)[:, 0],
            color=style.OURS,
            label="maximum entropy, m = 5",
        )
        left.set(title="densities", ylabel="h(φ) per rad")
        right.fill_between(phase, lower, upper, color="0.85", label="bounds")
        right.plot(phase, smoothed[3:].T, color="0.6", linewidth=0.4)
        right.plot([], [], color="0.6", linewidth=0.8, label="others with these moments")
        right.plot(
            phase,
            smoothed[0],
            color=style.TRUTH,
            linestyle=":",
            linewidth=2.2,
            label="ground truth",
        )
        right.plot(phase, smoothed[1], color=style.OURS, label="maximum entropy")
        right.set(title=f"smoothed by Poisson's kernel, r = {_RADIUS}", ylabel="h ∗ P per rad")
        for axes in (left, right):
            axes.set(xlabel="φ / rad", xlim=(0, 2 * np.pi), ylim=(0, None))
            axes.legend()
    return picture


FIGURE: Final = figure(7, make)
