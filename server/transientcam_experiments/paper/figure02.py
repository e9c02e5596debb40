"""Figure 2: the moments of a pixel, and what is reconstructed of them."""

from typing import Any, Final

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Sequence
from transientcam_experiments.paper import style
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot
from transientcam_experiments.paper.figure import FigureResult, Statement, Table, figure, state

SEQUENCE: Final = Sequence(base_frequency_hz=11.5e6, harmonics=7, takes=20)
_FRAME_S: Final = 19.3e-9
_GRID: Final = 1 << 17
_ORDER: Final = SEQUENCE.harmonics


def make(bench: Bench) -> FigureResult:
    """Capture the mirrors at seven frequencies, and follow one pixel."""
    shot = bench.shot("mirrors", SEQUENCE)
    y, x = _pixel(shot)
    sampled = shot.found.moments[:, :: bench.few(12, 40), :: bench.few(12, 40)].reshape(
        _ORDER + 1, -1
    )
    sampled = tm.bias(sampled.astype(np.complex128)).moments  # rounding took of what biasing gave
    phase = 2 * np.pi * np.arange(_GRID) / _GRID
    density = tm.density(tm.levinson(sampled), phase)
    return FigureResult(
        _draw(shot, y, x, phase),
        _statements(sampled, phase, density),
        (_table(sampled, density, phase), _moments(shot, y, x)),
    )


def _pixel(shot: ReconstructedShot) -> tuple[int, int]:
    """Return the pixel that has three returns, the weakest of which is the strongest of all."""
    third = shot.truth.weight[:3].min(axis=0) / shot.truth.brightness
    y, x = np.unravel_index(int(np.argmax(third)), third.shape)
    return int(y), int(x)


def _statements(b: Array, phase: Array, density: Array) -> list[Statement]:
    # the rectangle rule is exact to rounding for what has no harmonics beyond half the samples
    again = np.exp(1j * np.arange(_ORDER + 1)[:, None] * phase) @ density * (2 * np.pi / _GRID)
    reciprocal = np.abs(np.fft.rfft(1 / density, axis=0))
    beyond = reciprocal[_ORDER + 1 :].max(axis=0) / reciprocal[0]
    return [
        state("02.matches", float((np.abs(again - b) / b[0].real).max())),
        state("02.positive", float((density.min(axis=0) * 2 * np.pi / b[0].real).min())),
        state("02.reciprocal", float(beyond.max())),
        state("02.fourier", float((_inverse_fourier(b, phase).min(axis=0) < 0).mean())),
    ]


def _inverse_fourier(b: Array, phase: Array) -> Array:
    waves = np.exp(-1j * phase[:, None] * np.arange(1, b.shape[0]))
    result: Array = (b[0].real + 2 * (waves @ b[1:]).real) / (2 * np.pi)
    return result


def _table(b: Array, density: Array, phase: Array) -> Table:
    fourier = _inverse_fourier(b, phase)
    rows = [
        (
            name,
            float(np.median(each.min(axis=0) * scale)),
            float(np.median(each.max(axis=0) * scale)),
        )
        for name, each in (("maximum entropy", density), ("inverse Fourier", fourier))
        for scale in (2 * np.pi / b[0].real,)
    ]
    columns = ("reconstruction", "least density", "greatest density")
    return Table("Density over its mean, median of all pixels, m = 7", columns, rows)


def _moments(shot: ReconstructedShot, y: int, x: int) -> Table:
    b = shot.found.moments[:, y, x]
    rows = [
        (j, float(abs(value) / b[0].real), float(np.degrees(np.angle(value))))
        for j, value in enumerate(b)
    ]
    return Table("Moments of the pixel", ("j", "modulus over b_0", "phase in degrees"), rows)


def _draw(shot: ReconstructedShot, y: int, x: int, phase: Array) -> Any:
    with style.new(11.0, 6.6) as picture:
        halves: Any = picture.subfigures(2, 1, height_ratios=(1.0, 1.05))
        upper, lower = halves
        left, middle, right = upper.subfigures(1, 3, width_ratios=(1.0, 1.25, 1.25))
        _draw_scene(left, shot, y, x)
        _draw_signal(middle, shot, y, x, phase)
        _draw_reconstruction(right, shot, y, x, phase)
        _draw_moments(lower, shot, y, x)
    return picture


def _draw_scene(part: Any, shot: ReconstructedShot, y: int, x: int) -> None:
    axes = part.subplots()
    frame = shot.found.density(np.array([_FRAME_S]))[0]
    style.show(axes, frame * 1e-9, f"(a, e) reconstruction, τ = {_FRAME_S * 1e9:.1f} ns")
    axes.plot(x, y, "o", color="white", markerfacecolor="none", markersize=9, markeredgewidth=1.6)
    style.scale(part, axes, "density / (DN/ns)")


def _draw_signal(part: Any, shot: ReconstructedShot, y: int, x: int, phase: Array) -> None:
    response, modulation = part.subplots(2, 1, sharex=True)
    turn = 2 * np.pi * shot.base_frequency_hz
    there = shot.truth.weight[:, y, x] > 0
    at = turn * shot.truth.delay_s[there, y, x]
    response.vlines(at, 0, shot.truth.weight[there, y, x], color=style.TRUTH, linewidth=2.5)
    response.set(title="(b) the pixel's true returns", ylabel="weight / DN", ylim=(0, None))
    for j, colour in ((1, style.TRUTH), (2, style.OURS), (7, style.OTHER)):
        width = 1.6 if j < 7 else 0.8
        modulation.plot(phase, np.cos(j * phase), color=colour, linewidth=width, label=f"j = {j}")
    modulation.set(title="modulation cos(j φ)", xlabel="φ / rad", xlim=(0, 2 * np.pi))
    modulation.set_ylim(-1.15, 1.9)
    modulation.legend(loc="upper right", ncols=3)


def _draw_reconstruction(part: Any, shot: ReconstructedShot, y: int, x: int, phase: Array) -> None:
    upper, lower = part.subplots(2, 1, sharex=True)
    b = tm.bias(shot.found.moments[:, y, x].astype(np.complex128)).moments
    h = tm.density(tm.levinson(b), phase)
    upper.plot(phase, h, color=style.OURS, label="maximum entropy")
    fourier = _inverse_fourier(b[:, None], phase)[:, 0]
    upper.plot(phase, fourier, color=style.OTHER, linewidth=1.0, label="inverse Fourier")
    there = shot.truth.weight[:, y, x] > 0
    for at in 2 * np.pi * shot.base_frequency_hz * shot.truth.delay_s[there, y, x]:
        upper.axvline(at, color=style.TRUTH, linewidth=0.8, linestyle=":")
    upper.set(title="(d) reconstructed h(φ)", ylabel="h / (DN/rad)")
    upper.set_ylim(1.3 * fourier.min(), 2.2 * fourier.max())
    upper.legend(loc="upper right")
    lower.semilogy(phase, h.max() / h, color=style.OURS)
    lower.set(title="its reciprocal, a Fourier series of degree 7", xlabel="φ / rad")
    lower.set(ylabel="1 / h, relative", xlim=(0, 2 * np.pi))


def _draw_moments(part: Any, shot: ReconstructedShot, y: int, x: int) -> None:
    panels = part.subplots(2, 4)
    part.suptitle("(c) trigonometric moment images: real parts", fontsize=9.5)
    b = shot.found.moments
    most = float(np.percentile(b[0].real, 99))
    for j, axes in enumerate(panels.flat):
        style.show(axes, b[j].real, f"Re b_{j}", colours=style.SIGNED, least=-most, most=most)
    style.scale(part, list(panels.flat), "DN")


FIGURE: Final = figure(2, make)
