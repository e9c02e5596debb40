"""Density evaluation against NumPy, this machine's ceiling and the paper's graphics card."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import CORES, PAPER, Array, lane, moments, numpy_alone
from benchmarks.common.tables import Table, verdict
from benchmarks.common.timing import measure
from benchmarks.speed.ceiling import Ceiling, measured, together

ORDERS = (3, 4, 8)
# Sec. 6.3: density frames a second of 163 x 120 pixels on a GTX 780
PAPER_FRAMES_S = {3: 2.9e5, 4: 2.2e5, 8: 1.1e5}
_CACHED, _STREAMED = 48, 1024  # frames: 3.8 MB a core, as much as the ceiling writes, and 80 MB
_OFTEN = 20
_OF_NUMPY = (48, 192)  # frames in one call; the quicker of both counts
_PHASES: dict[str, Callable[[int], Array]] = {
    "any": lambda count: np.random.default_rng(count).uniform(0, 2 * np.pi, count),
    "equidistant": lambda count: np.linspace(0, 2 * np.pi, count, endpoint=False),
}


def tables() -> Iterator[Table]:
    """Measure frames a second of 163 x 120 pixels in float32."""
    tm.kernels.compile()
    ceilings = {cores: measured(cores) for cores in sorted({1, CORES})}
    yield _ceiling_table(ceilings)
    table = Table(
        "Density, 163 x 120, float32, modulus: frames a second",
        ("m, phases, cores, frames", "lane", "NumPy", "gain", "roofline", "share", "paper"),
    )
    for m in ORDERS:
        rows, notes = _rows(m, ceilings)
        table.rows.extend(rows)
        table.notes.extend(notes)
    yield table


def _rows(m: int, ceilings: dict[int, Ceiling]) -> tuple[list[Sequence[str]], list[str]]:
    c = tm.levinson(moments(m, PAPER))
    rows: list[Sequence[str]] = []
    notes: list[str] = []
    numpy_s = _numpy_frames_s(c)
    cases = itertools.product(_PHASES, ceilings, (("cached", _CACHED), ("streamed", _STREAMED)))
    for phases, cores, (kind, frames) in cases:
        ceiling = ceilings[cores]
        measured_s = _cached_frames_s if kind == "cached" else _frames_s
        rate = measured_s(c, _PHASES[phases](frames), cores)
        fused = 4 * m + 2 if phases == "any" else 2 * m + 4
        writes = ceiling.cached_bytes_s if kind == "cached" else ceiling.stream_bytes_s
        roof = min(ceiling.fused_s / fused, writes / 4) / c.error.size
        label = f"m = {m}, {phases} phases, {kind}, {cores} cores"
        notes.append(verdict(rate / roof, 0.6, f"{label}, share of the roofline"))
        against_numpy = ("", "")
        if cores == CORES:
            against_numpy = (f"{numpy_s:.3g}", f"{rate / numpy_s:.1f}")
            notes.append(verdict(rate / numpy_s, 12, f"{label}, times NumPy"))
            notes.append(verdict(rate, PAPER_FRAMES_S[m], f"{label}, paper's GPU"))
        shares = (f"{roof:.3g}", f"{100 * rate / roof:.0f} %", f"{PAPER_FRAMES_S[m]:.3g}")
        name = f"{m}, {phases}, {cores}, {kind}"
        rows.append((name, f"{rate:.3g}", *against_numpy, *shares))
    return rows, notes


def _frames_s(c: tm.Coefficients, phase_rad: Array, cores: int) -> float:
    frames = phase_rad.size
    out = np.empty((frames, *PAPER), np.float32)
    evaluate = lane("density", c.polynomial)
    with ThreadPoolExecutor(max(1, cores - 1)) as executor:
        spread = tm.kernels.over(executor, cores)
        run = partial(evaluate, c.polynomial, c.reflection, c.error, phase_rad, out, spread=spread)
        return frames / measure(run).median_s


def _cached_frames_s(c: tm.Coefficients, phase_rad: Array, cores: int) -> float:
    frames = phase_rad.size
    evaluate = lane("density", c.polynomial)
    outs = [np.empty((frames, *PAPER), np.float32) for _ in range(cores)]

    def work(core: int) -> None:
        for _ in range(_OFTEN):
            evaluate(c.polynomial, c.reflection, c.error, phase_rad, outs[core])

    return cores * _OFTEN * frames / measure(lambda: together(cores, work)).median_s


def _numpy_frames_s(c: tm.Coefficients) -> float:
    rates: list[float] = []
    for frames in _OF_NUMPY:
        phase_rad = np.linspace(0, 2 * np.pi, frames, endpoint=False)
        with numpy_alone():
            rates.append(frames / measure(partial(tm.density, c, phase_rad)).median_s)
    return max(rates)


def _ceiling_table(ceilings: dict[int, Ceiling]) -> Table:
    table = Table(
        "This machine's ceiling, float32",
        ("cores", "fused multiply-adds / s", "writes in cache", "writes past the caches"),
    )
    for cores, ceiling in ceilings.items():
        table.rows.append(
            (
                str(cores),
                f"{ceiling.fused_s / 1e9:.0f} e9",
                f"{ceiling.cached_bytes_s / 1e9:.1f} GB/s",
                f"{ceiling.stream_bytes_s / 1e9:.1f} GB/s",
            )
        )
    return table
