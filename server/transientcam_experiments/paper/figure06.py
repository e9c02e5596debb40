"""Figure 6: strength and time of the three strongest returns (Sec. 5.1)."""

from typing import Any, Final

import numpy as np

from transientcam_driver import Sequence
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.mirrors import shots, thrice

_SEQUENCE: Final = Sequence(harmonics=4, base_frequency_hz=23e6, takes=30)
_NAMES: Final = ("strongest", "second", "third")
_NEAR_S: Final = 0.5e-9
_SHOWN: Final = 0.02
"""Returns below this share of a pixel's strongest are not drawn."""


def make(bench: Bench) -> FigureResult:
    """Capture the mirrors with 30 takes, and rank Pisarenko's returns by strength."""
    shot, again = shots(bench, _SEQUENCE, frames=2)
    time_s, weight = _strongest(shot)
    where = thrice(shot)
    errors = [_errors(shot, k) for k in range(3)]
    noise = [_noise(shot, again, k) for k in range(3)]
    return FigureResult(
        _draw(time_s, weight),
        _statements(shot, where, errors, noise),
        (_table(shot, where, errors, noise),),
        (
            'The paper says "four moments": we take m = 4 frequencies besides the zeroth, so that '
            "there is a fourth return for what noise and stray light make up.",
        ),
    )


def _strongest(shot: ReconstructedShot) -> tuple[Array, Array]:
    """Return times in s and weights (3, H, W) of the three strongest returns, by strength."""
    returns = shot.found.returns
    order = np.argsort(-returns.weight, axis=0)[:3]
    phase = np.take_along_axis(returns.phase_rad, order, axis=0)
    weight = np.take_along_axis(returns.weight, order, axis=0)
    return phase / (2 * np.pi * shot.base_frequency_hz), weight


def _ranked_truth(shot: ReconstructedShot) -> tuple[Array, Array]:
    order = np.argsort(-shot.truth.weight, axis=0)[:3]
    delay_s = np.take_along_axis(shot.truth.delay_s, order, axis=0)
    return delay_s, np.take_along_axis(shot.truth.weight, order, axis=0)


def _errors(shot: ReconstructedShot, k: int) -> tuple[Array, Array]:
    """Return errors (H, W) of time in s and of strength: of the return nearest the true k-th."""
    delay_s, true_weight = _ranked_truth(shot)
    time_s, weight = _strongest(shot)
    apart = np.where(np.isfinite(time_s), np.abs(time_s - delay_s[k]), np.inf)
    nearest = apart.argmin(axis=0)[None]
    of_time = np.take_along_axis(time_s, nearest, axis=0)[0] - delay_s[k]
    found = np.take_along_axis(weight, nearest, axis=0)[0]
    of_weight = found / np.where(true_weight[k] > 0, true_weight[k], np.nan) - 1
    return of_time, of_weight


def _noise(one: ReconstructedShot, other: ReconstructedShot, k: int) -> float:
    """Return the deviation of the time of the k-th true return between captures, in s: typical."""
    difference = (_errors(one, k)[0] - _errors(other, k)[0])[thrice(one)]
    typical = np.median(np.abs(difference[np.isfinite(difference)]))
    return float(typical / 0.6745 / np.sqrt(2))


def _statements(
    shot: ReconstructedShot, where: Array, errors: list[tuple[Array, Array]], noise: list[float]
) -> list[Statement]:
    near = np.all([np.abs(each[0]) < _NEAR_S for each in errors], axis=0)
    _, weight = _strongest(shot)
    shares = np.array([weight[k][where].sum() for k in range(3)])
    true = np.array([_ranked_truth(shot)[1][k][where].sum() for k in range(3)])
    return [
        state("06.separated", float(near[where].mean()), near_ns=_NEAR_S * 1e9),
        state("06.weaker", min(noise[1] / noise[0], noise[2] / noise[1])),
        state("06.strengths", float(np.abs(shares / true - 1).max())),
    ]


def _table(
    shot: ReconstructedShot, where: Array, errors: list[tuple[Array, Array]], noise: list[float]
) -> Table:
    rows = [
        {
            "return": name,
            "true strength / DN": float(np.median(_ranked_truth(shot)[1][k][where])),
            "median error of time / ps": float(np.median(np.abs(errors[k][0][where])) * 1e12),
            "deviation between captures / ps": noise[k] * 1e12,
            "median error of strength / %": float(np.median(np.abs(errors[k][1][where]))) * 100,
        }
        for k, name in enumerate(_NAMES)
    ]
    return Table.of("Pixels with three returns", rows)


def _draw(time_s: Array, weight: Array) -> Any:
    with style.new(11.0, 5.6) as picture:
        upper, lower = picture.subplots(2, 3)
        seen = weight > _SHOWN * weight[:1]
        most = float(np.percentile(weight[0], 99))
        for k, name in enumerate(_NAMES):
            style.show(upper[k], np.where(seen[k], weight[k], 0), f"{name}: strength", most=most)
            when = np.where(seen[k], time_s[k] * 1e9, np.nan)
            style.show(
                lower[k],
                when,
                f"{name}: time of flight",
                colours=style.DEPTH,
                least=10.0,
                most=30.0,
            )
        style.scale(picture, list(upper), "DN")
        style.scale(picture, list(lower), "ns")
    return picture


FIGURE: Final = figure(6, make)
