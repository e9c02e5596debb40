"""Figure 10: a corner of which only the left wall is lit directly (Sec. 6.1)."""

from pathlib import Path
from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state
from transientcam_experiments.tradeoff.truth import Sample, cumulative

_SEQUENCE: Final = Sequence(harmonics=4, base_frequency_hz=23e6, takes=40)
_SCENE: Final = Path(__file__).with_name("large-corner.toml")
_TIMES_S: Final = (21.5e-9, 26.0e-9, 29.5e-9)
_PHASES: Final = 128


def make(bench: Bench) -> FigureResult:
    """Capture the corner, with its zeroth moment and as if it had not been measured."""
    shot = bench.shot(str(_SCENE), _SEQUENCE)
    estimated = tm.bias(tm.estimate_zeroth(np.array(shot.found.smoothed))).moments
    walls = {name: _Wall(shot, estimated, where, bench) for name, where in _walls(shot).items()}
    return FigureResult(_draw(shot, walls), _statements(shot, walls), (_table(walls),))


def _walls(shot: ReconstructedShot) -> dict[str, Array]:
    """Return the pixels of each wall, without those near the edge between them."""
    column = np.arange(shot.lit.shape[1]) / shot.lit.shape[1]
    left = np.broadcast_to(column < 0.45, shot.lit.shape)
    right = np.broadcast_to(column > 0.6, shot.lit.shape)
    return {"left wall": left & shot.lit, "right wall": right & shot.lit}


class _Wall:
    """What is measured of one wall: sharpness of peaks, and errors of sampled pixels."""

    def __init__(
        self, shot: ReconstructedShot, estimated: Array, where: Array, bench: Bench
    ) -> None:
        turn = 2 * np.pi * shot.base_frequency_hz
        y, x = np.nonzero(where)
        chosen = np.linspace(0, y.size - 1, bench.few(300, 40)).astype(int)
        self.y, self.x = y[chosen], x[chosen]
        light = []
        for row, column in zip(self.y.tolist(), self.x.tolist(), strict=True):
            time_s, value = shot.truth.impulse_response(column, row)
            light.append((time_s, value / value.sum()))
        self.sample = Sample(self.y, self.x, tuple(light))
        self.phase = 2 * np.pi * np.arange(_PHASES) / _PHASES
        self.true = cumulative(self.sample, self.phase, base_frequency_hz=shot.base_frequency_hz)
        measured = shot.found.moments[:, self.y, self.x]
        brightness = shot.truth.brightness[self.y, self.x]
        self.error = self._error(measured, brightness)
        self.error_without = self._error(estimated[:, self.y, self.x], brightness)
        self.width_ns = _width_ns(measured, turn)
        self.width_without_ns = _width_ns(estimated[:, self.y, self.x], turn)
        self.true_width_ns = float(np.median([_spread(*each) for each in light])) * 1e9
        self.eigenvalue = float(np.median(shot.found.validity[self.y, self.x]))
        exact = _moments(light, turn)
        self.exact_width_ns = _width_ns(exact, turn)
        self.exact_error = self._error(exact, np.ones(self.y.size))
        self.true_eigenvalue = float(np.median(tm.smallest_eigenvalue(exact)))

    def _error(self, b: Array, brightness: Array) -> float:
        found = tm.cumulative(tm.levinson(b), self.phase) / brightness
        return float(np.abs(found - self.true).mean())


def _moments(light: list[tuple[Array, Array]], turn: float) -> Array:
    """Return the moments (m + 1, P) of responses of brightness 1, without any error."""
    j = np.arange(_SEQUENCE.harmonics + 1)[:, None]
    each = [np.exp(1j * j * turn * time_s) @ share for time_s, share in light]
    return np.stack(each, axis=1)


def _width_ns(b: Array, turn: float) -> float:
    """Return the typical time in which the middle half of the light comes back."""
    phase = np.linspace(0, 2 * np.pi, 2049)
    back = np.asarray(tm.cumulative(tm.levinson(b), phase)) / b[0].real
    quarters = [(back >= share).argmax(axis=0) for share in (0.25, 0.75)]
    return float(np.median(phase[quarters[1]] - phase[quarters[0]]) / turn * 1e9)


def _spread(time_s: Array, share: Array) -> float:
    back = np.cumsum(share)
    first, last = (int(np.searchsorted(back, part)) for part in (0.25, 0.75))
    return float(time_s[last] - time_s[first])


def _statements(shot: ReconstructedShot, walls: dict[str, _Wall]) -> list[Statement]:
    left, right = walls["left wall"], walls["right wall"]
    reason = (
        f"the smallest eigenvalue of the true response is {right.true_eigenvalue:.3%} of b_0 on "
        f"our right wall, and the device's systematic errors leave {right.eigenvalue:.2%}"
    )
    return [
        state(
            "10.rate",
            1 / (shot.applied.capture_s / shot.applied.sequence.takes * _SEQUENCE.takes),
            at_least=0.22 * 0.95,
            at_most=0.22 * 1.05,
        ),
        state("10.sharp_and_soft", right.width_ns / left.width_ns),
        state(
            "10.measured_zeroth",
            right.width_ns / right.true_width_ns,
            reason=reason,
            exact=right.exact_width_ns / right.true_width_ns,
        ),
        state("10.helps", right.error / right.error_without, reason=reason),
    ]


def _table(walls: dict[str, _Wall]) -> Table:
    rows = [
        {
            "pixels of the": name,
            "true width / ns": wall.true_width_ns,
            "width / ns": wall.width_ns,
            "width, b_0 estimated / ns": wall.width_without_ns,
            "error / % of b_0": 100 * wall.error,
            "error, b_0 estimated / % of b_0": 100 * wall.error_without,
            "smallest eigenvalue / % of b_0": 100 * wall.eigenvalue,
            "width, exact moments / ns": wall.exact_width_ns,
            "error, exact moments / % of b_0": 100 * wall.exact_error,
            "true smallest eigenvalue / % of b_0": 100 * wall.true_eigenvalue,
        }
        for name, wall in walls.items()
    ]
    return Table.of(
        "Time of the middle half of the light, and error of the cumulative density", rows
    )


def _draw(shot: ReconstructedShot, walls: dict[str, _Wall]) -> Any:
    frames = np.asarray(shot.found.density(np.array(_TIMES_S))) * 1e-9
    with style.new(11.0, 5.6) as picture:
        parts: Any = picture.subfigures(2, 1)
        upper, lower = parts
        panels = upper.subplots(1, 3)
        for axes, frame, time_s, letter in zip(panels, frames, _TIMES_S, "abc", strict=True):
            # the logarithm, so that the soft wave is seen beside the sharp one
            style.show(
                axes,
                np.log10(np.maximum(frame, 1e-3)),
                f"({letter}) τ = {time_s * 1e9:.1f} ns",
                most=4.3,
            )
        style.scale(upper, list(panels), "log₁₀ of DN/ns")
        for axes, (name, wall) in zip(lower.subplots(1, 2), walls.items(), strict=True):
            _draw_pixel(axes, shot, name, wall)
    return picture


def _draw_pixel(axes: Any, shot: ReconstructedShot, name: str, wall: _Wall) -> None:
    """Draw the cumulative density of the wall's middle pixel."""
    middle = len(wall.y) // 2
    y, x = int(wall.y[middle]), int(wall.x[middle])
    time_ns = np.linspace(15, 43, 400)
    time_s, value = shot.truth.impulse_response(x, y)
    back = np.append(0.0, np.cumsum(value / value.sum()))
    true = back[np.searchsorted(time_s, time_ns * 1e-9, side="right")]
    found = np.asarray(shot.found.cumulative(time_ns * 1e-9))[:, y, x]
    axes.plot(time_ns, true, color=style.TRUTH, linestyle=":", linewidth=2.2, label="truth")
    brightness = shot.truth.brightness[y, x]
    axes.plot(time_ns, found / brightness, color=style.OURS, label="maximum entropy")
    axes.set(title=f"{name}: light that is back, pixel ({x}, {y})", xlabel="τ / ns")
    axes.set(ylabel="over the brightness", xlim=(15, 43), ylim=(-0.02, 1.08))
    axes.legend(loc="lower right")


FIGURE: Final = figure(10, make)
