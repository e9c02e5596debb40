"""Responses whose tail is no gamma distribution, and what exponent suits them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.measured_scenes import data_folder
from benchmarks.common.tables import Table
from benchmarks.likelihood.errors import Array, errors_of, ranges, turn_m
from transientcam_moments.likelihood import MODEL_ERROR, choice

BASE_HZ: Final = 23e6
NOISE_SHARE: Final = 1 / 200
ORDERS: Final = (3, 4, 6)
SHAPES: Final = (1, 2, 3, 4)
CORNELL_STEP: Final = 3
"""Every third pixel of each axis of the rendering is looked at."""
SEED: Final = 1


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """Impulse responses of pixels: light at times of flight, and where the first return is."""

    name: str
    time_s: Array
    """Shape (T,)."""
    light: Array
    """Shape (P, T)."""
    first_s: Array
    """Shape (P,)."""

    def moments(self, m: int) -> Array:
        """Return moments (m + 1, P) over b_0."""
        turn = np.exp(2j * np.pi * BASE_HZ * self.time_s[:, None] * np.arange(m + 1))
        b: Array = (self.light @ turn).T
        share: Array = b / b[0].real
        return share


def tables() -> Iterator[Table]:
    """Measure the range of one return with a tail by each exponent, and of the other estimators."""
    data = data_folder()
    responses = [*(() if data is None else measured(data)), *_rendered(data)]
    for m in ORDERS:
        table = Table(
            f"Tails of other shapes, m = {m}: median / 90 % / RMSE / bias, mm",
            (
                "response",
                "maximum entropy",
                "Pisarenko",
                *(f"p = {p}, a tail or none" for p in SHAPES),
                "likelihood",
                "explained",
            ),
            notes=[
                f"f = 23 MHz; every part of a moment has a standard deviation of "
                f"1/{1 / NOISE_SHARE:.0f} of b_0. likelihood: the average over models, p = "
                f"{', '.join(map(str, sorted(choice.TAIL_SHAPES)))}."
            ],
        )
        for each in responses:
            table.rows.append(_row(each, m))
        yield table


def _row(responses: Responses, m: int) -> tuple[str, ...]:
    b = responses.moments(m)
    noise = tm.noise.MomentNoise(np.full(b.shape, NOISE_SHARE**2))
    noisy = tm.noise.draw(b, noise, np.random.default_rng(SEED), draws=1)[:, 0]
    truth = tm.SPEED_OF_LIGHT_M_S * responses.first_s / 2
    found = ranges(noisy, tm.Settings(base_frequency_hz=BASE_HZ), noise=noise)
    columns = [found["maximum-entropy"], found["pisarenko"]]
    for shape in SHAPES:
        phase = tm.likelihood(noisy, noise, returns=1, tail_shape=shape).separate().phase_rad
        columns.append(np.asarray(tm.range_m(phase, BASE_HZ)))
    columns.append(found["likelihood"])
    explained = tm.likelihood(noisy, noise, model_error=MODEL_ERROR).explained().mean()
    cells = (str(errors_of(each, truth, turn_m(BASE_HZ))) for each in columns)
    return (responses.name, *cells, f"{explained:.0%}")


def measured(data: Path, pixels: int = 500) -> Iterator[Responses]:
    """Yield composites of measured responses, each with its returns at random times."""
    parts = {}
    for name in ("direct", "1_0_inch", "3_0_inch"):
        path = data / "measured" / f"capture_{name}.npz"
        if not path.is_file():
            return
        with np.load(path) as file:
            counts = np.maximum(file["counts"].astype(float) - np.median(file["counts"]), 0)
            parts[name] = counts / counts.sum()
            bin_s = float(file["bin_s"])
    bins = min(part.size for part in parts.values())
    parts = {name: part[:bins] for name, part in parts.items()}
    zero = int(parts["direct"].argmax())
    time_s = (np.arange(parts["direct"].size) - zero) * bin_s
    random = np.random.default_rng(SEED)
    for name, mix in (
        ("direct + 1.0 inch of foam", (("direct", 0.5, 0.0), ("1_0_inch", 0.5, 0.0))),
        ("direct + 3.0 inches of foam", (("direct", 0.5, 0.0), ("3_0_inch", 0.5, 0.0))),
        (
            "direct, 1.0 inch 6 ns, 3.0 inches 17 ns later",
            (("direct", 0.55, 0.0), ("1_0_inch", 0.3, 6e-9), ("3_0_inch", 0.5, 17e-9)),
        ),
    ):
        first = random.uniform(2e-9, 6e-9, pixels)
        light = sum(
            share * np.roll(parts[part], round(later / bin_s)) for part, share, later in mix
        )
        shifts = np.round(first / bin_s).astype(int)
        shifted = np.stack([np.roll(light, shift) for shift in shifts])
        yield Responses(name, time_s, shifted, shifts * bin_s)


def _rendered(data: Path | None) -> Iterator[Responses]:
    """Yield the rendered Cornell box; its first return is the first maximum of its light."""
    path = None if data is None else data / "rendered" / "mitransient_cornell_163x120x300.npz"
    if path is None or not path.is_file():
        return
    with np.load(path) as file:
        light = file["h"][::CORNELL_STEP, ::CORNELL_STEP].astype(float).reshape(-1, 300)
        start, step = float(file["start_opl_m"]), float(file["bin_opl_m"])
    light = light[light.sum(axis=1) > 0]
    kernel = np.exp(-0.5 * (np.arange(-8, 9) / 3) ** 2)
    soft = np.stack([np.convolve(each, kernel, "same") for each in light])
    peak = (soft[:, 1:-1] > soft[:, :-2]) & (soft[:, 1:-1] >= soft[:, 2:])
    peak &= soft[:, 1:-1] > 0.1 * soft.max(axis=1, keepdims=True)
    known = peak.any(axis=1)
    first = peak[known].argmax(axis=1) + 1
    time_s = (start + step * np.arange(300)) / tm.SPEED_OF_LIGHT_M_S
    yield Responses("Cornell box, rendered", time_s, light[known], time_s[first])
