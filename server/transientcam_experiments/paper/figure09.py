"""Figure 9: the light that has come back until a time, for the captures of Figure 8."""

from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.paper.mirrors import (
    SEQUENCES,
    TIMES_S,
    returned,
    shots,
    thrice,
    title,
)

_QUADRATURE: Final = 100_000
_FRONT_S: Final = 0.5e-9


def make(bench: Bench) -> FigureResult:
    """Integrate the densities of Figure 8."""
    captures = {name: shots(bench, sequence, frames=2) for name, sequence in SEQUENCES.items()}
    times_s = np.arange(9e-9, 36e-9, bench.few(1, 3) * 0.25e-9)
    errors = {name: _Errors(pair[0], times_s) for name, pair in captures.items()}
    return FigureResult(
        _draw({name: pair[0] for name, pair in captures.items()}),
        _statements(captures, errors),
        (_table(captures, errors),),
    )


class _Errors:
    """Errors of the cumulative density (P) over the brightness, in pixels with three returns.

    ``waves`` (3, P) are those half way between a return and the next, or 3 ns after the last:
    there every wave so far counts in full. ``fronts`` (3, P) are half a nanosecond before each
    return.
    """

    def __init__(self, shot: ReconstructedShot, times_s: Array) -> None:
        where = thrice(shot)
        found = np.asarray(shot.found.cumulative(times_s))[:, where]
        delay_s = shot.truth.delay_s[:3][:, where]
        between_s = np.concatenate([(delay_s[:-1] + delay_s[1:]) / 2, delay_s[-1:] + 3e-9])
        self._brightness = shot.truth.brightness[where]
        self._shot, self._where, self._times_s, self._found = shot, where, times_s, found
        self.waves = np.array([self._of(time_s) for time_s in between_s])
        self.fronts = np.array([self._of(time_s - _FRONT_S) for time_s in delay_s])

    def _of(self, time_s: Array) -> Array:
        index = np.abs(self._times_s[:, None] - time_s).argmin(axis=0)
        at_s = np.zeros(self._where.shape)
        at_s[self._where] = self._times_s[index]
        true = returned(self._shot, at_s)[self._where]
        found = np.take_along_axis(self._found, index[None], axis=0)[0]
        errors: Array = (found - true) / self._brightness
        return errors


def _noise(pair: list[ReconstructedShot], *, cumulative: bool) -> float:
    """Return the typical relative difference of two captures behind the first wave."""
    time_s = np.array([TIMES_S[0], 15e-9])
    one, other = (
        np.asarray(
            shot.found.cumulative(time_s)[1] if cumulative else shot.found.density(time_s)[0]
        )
        for shot in pair
    )
    bright = one + other > np.percentile(one + other, 75)
    return float(np.median(2 * np.abs(one - other)[bright] / (one + other)[bright]))


def _quadrature_error(shot: ReconstructedShot) -> float:
    """Return the distance of the closed form from the paper's quadrature, over the brightness."""
    y, x = np.nonzero(shot.lit)
    chosen = np.linspace(0, y.size - 1, 12).astype(int)
    b = tm.bias(shot.found.moments[:, y[chosen], x[chosen]].astype(np.complex128)).moments
    coefficients = tm.levinson(b)
    step = 2 * np.pi / _QUADRATURE
    edges = (np.arange(_QUADRATURE) + 0.5) * step
    summed = np.cumsum(tm.density(coefficients, edges), axis=0) * step
    at = np.arange(1, 8) * _QUADRATURE // 8
    closed = tm.cumulative(coefficients, at * step)
    return float(np.abs((closed - summed[at - 1]) / b[0].real).max())


def _statements(
    captures: dict[str, list[ReconstructedShot]], errors: dict[str, _Errors]
) -> list[Statement]:
    typical = {name: float(np.median(np.abs(each.waves))) for name, each in errors.items()}
    worst = {name: float(np.percentile(np.abs(each.waves), 95)) for name, each in errors.items()}
    front = {name: float(np.median(np.abs(each.fronts))) for name, each in errors.items()}
    return [
        state("09.total", max(typical.values())),
        state("09.always", max(worst.values())),
        state("09.fronts", front["a"] / typical["a"], front_ns=_FRONT_S * 1e9),
        state(
            "09.robust",
            _noise(captures["a"], cumulative=True) / _noise(captures["a"], cumulative=False),
        ),
        state("09.quadrature", _quadrature_error(captures["b"][0])),
    ]


def _table(captures: dict[str, list[ReconstructedShot]], errors: dict[str, _Errors]) -> Table:
    rows = [
        (
            title(name),
            *(100 * float(np.median(np.abs(wave))) for wave in errors[name].waves),
            *(100 * float(np.median(np.abs(front))) for front in errors[name].fronts),
            100 * _noise(pair, cumulative=True),
        )
        for name, pair in captures.items()
    ]
    columns = (
        "captured with", "after wave 1", "after wave 2", "after wave 3", "before front 1",
        "before front 2", "before front 3", "between two captures",
    )  # fmt: skip
    return Table("Median error of the cumulative density in % of the brightness", columns, rows)


def _draw(first: dict[str, ReconstructedShot]) -> Any:
    with style.new(10.0, 7.6) as picture:
        rows: Any = picture.subfigures(3, 1)
        for part, (name, shot) in zip(rows, first.items(), strict=True):
            part.suptitle(title(name), fontsize=9.5, x=0.02, ha="left")
            panels = part.subplots(1, 3)
            most = float(np.percentile(shot.truth.brightness, 99))
            frames = np.asarray(shot.found.cumulative(np.array(TIMES_S)))
            for axes, frame, time_s in zip(panels, frames, TIMES_S, strict=True):
                style.show(axes, frame, f"until τ = {time_s * 1e9:.1f} ns", most=most)
            style.scale(part, list(panels), "DN")
    return picture


FIGURE: Final = figure(9, make)
