"""Draw the pictures of docs/mathematics.md: ``python -m tools.mathematics``.

One pixel without noise, whose moments are known in closed form: two sharp returns and a share of
uniform light. Nothing is captured, and no number depends on the machine.
"""

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import transientcam_moments as tm
from benchmarks.common.picture import blank, saved
from benchmarks.common.records import DOCS

BASE_FREQUENCY_HZ: Final = 23e6
RETURNS_S: Final = np.array([10e-9, 17e-9])
WEIGHTS: Final = np.array([0.6, 0.35])
UNIFORM: Final = 0.05
_PERIOD_S: Final = 1 / BASE_FREQUENCY_HZ
_NS: Final = 1e-9


def moments(times_s: np.ndarray, weights: np.ndarray, uniform: float, m: int) -> np.ndarray:
    """Return b_0 .. b_m (m + 1, ...) of sharp returns (K, ...) and uniform light: Eq. (1)."""
    phase_rad = 2 * np.pi * BASE_FREQUENCY_HZ * times_s
    order = np.arange(m + 1).reshape(-1, *[1] * times_s.ndim)
    b: np.ndarray = (weights * np.exp(1j * order * phase_rad)).sum(1)
    b[0] += uniform
    return b


def _of_pixel(m: int) -> np.ndarray:
    return moments(RETURNS_S, WEIGHTS, UNIFORM, m)


def _phases(count: int = 2001) -> tuple[np.ndarray, np.ndarray]:
    """Return times of flight in ns, and their phases in radian."""
    time_s = np.linspace(0, _PERIOD_S, count)
    return time_s / _NS, 2 * np.pi * BASE_FREQUENCY_HZ * time_s


def _figure(columns: int) -> tuple[Figure, np.ndarray]:
    figure = blank(8.0, 3.2)
    return figure, np.atleast_1d(figure.subplots(1, columns))


def _truth(panel: Axes, height: float) -> None:
    heights = height * WEIGHTS / WEIGHTS.max()
    stems = panel.stem(RETURNS_S / _NS, heights, "k", markerfmt="ko", basefmt=" ")
    stems.set_label("truth")
    panel.set(xlabel="time of flight / ns", xlim=(0, _PERIOD_S / _NS))


def measured() -> Figure:
    """Draw the waves that light is multiplied with, and the moments that come of it."""
    figure, (waves, plane) = _figure(2)
    time_ns, phase_rad = _phases()
    for j in (1, 2, 3):
        waves.plot(time_ns, 0.5 + 0.4 * np.cos(j * phase_rad), f"C{j}", label=f"wave j = {j}")
    _truth(waves, 1.0)
    waves.set(title="light, and what it is multiplied with", yticks=[])
    b = _of_pixel(3)
    for j in (1, 2, 3):
        beyond = b[j] * (1 + 0.14 / abs(b[j]))
        tip, label = (b[j].real, b[j].imag), (beyond.real, beyond.imag)
        plane.annotate("", tip, (0, 0), arrowprops={"arrowstyle": "->", "color": f"C{j}"})
        plane.annotate(f"$b_{j}$", label, color=f"C{j}", ha="center", va="center")
    circle = np.exp(1j * phase_rad) * b[0].real
    plane.plot(circle.real, circle.imag, "0.8")
    plane.set(
        aspect="equal", title="what is left: one arrow a wave", xlabel="real", ylabel="imaginary"
    )
    waves.legend(fontsize="small", loc="lower right")
    return figure


def reconstructed() -> Figure:
    """Draw the maximum entropy density for more and more frequencies."""
    figure, (panel,) = _figure(1)
    time_ns, phase_rad = _phases()
    highest = 0.0
    for number, m in enumerate((1, 2, 3, 4)):
        density = tm.density(tm.levinson(_of_pixel(m)[:, None]), phase_rad)[:, 0]
        highest = max(highest, float(density.max()))
        panel.plot(time_ns, density, f"C{number}", label=f"m = {m}")
    _truth(panel, highest)
    panel.set(ylabel="density / rad⁻¹", title="the same light from m frequencies and b₀")
    panel.legend()
    return figure


def bounded() -> Figure:
    """Draw the bounds on every light that has these moments."""
    figure, (panel,) = _figure(1)
    time_ns, phase_rad = _phases()
    b = _of_pixel(4)[:, None]
    lower, upper = (each[:, 0] for each in tm.bounds(b, phase_rad))
    panel.fill_between(time_ns, lower, upper, color="C0", alpha=0.3, label="all that is possible")
    panel.plot(
        time_ns, tm.smoothed_density(tm.levinson(b), phase_rad)[:, 0], "C0", label="estimate"
    )
    _truth(panel, float(upper.max()))
    panel.set(ylabel="smoothed density / rad⁻¹", title="m = 4: what four frequencies leave open")
    panel.legend()
    return figure


def ranged() -> Figure:
    """Draw the error of the range over the detour of a second return."""
    figure, (panel,) = _figure(1)
    detour_m = np.linspace(0.1, 3.0, 300)
    first_s = np.full_like(detour_m, RETURNS_S[0])
    times_s = np.stack([first_s, first_s + detour_m / tm.SPEED_OF_LIGHT_M_S])
    b = moments(times_s, np.array([[0.7], [0.3]]), 0.0, 3)
    true_m = tm.SPEED_OF_LIGHT_M_S * RETURNS_S[0] / 2
    for label, phase_rad in (
        ("one frequency", np.angle(b[1]) % (2 * np.pi)),
        ("three frequencies, separated", tm.separate(tm.pisarenko(b)).phase_rad),
    ):
        error_m = tm.range_m(phase_rad, BASE_FREQUENCY_HZ) - true_m
        panel.plot(detour_m, 1e3 * error_m, label=label)
    panel.set(
        xlabel="detour of 30 % of the light / m",
        ylabel="error of the range / mm",
        title="light on a detour makes the range too long",
    )
    panel.legend()
    return figure


PICTURES: Final = {
    "mathematics-moments.png": measured,
    "mathematics-density.png": reconstructed,
    "mathematics-bounds.png": bounded,
    "mathematics-range.png": ranged,
}


if __name__ == "__main__":
    for _name, _picture in PICTURES.items():
        (DOCS / "figures" / _name).write_bytes(saved(_picture(), "png"))
        print(_name)
