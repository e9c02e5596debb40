"""Ways to average moments over neighbours: errors against the truth of scenes, and time."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.common.data import PAPER, SETTINGS, VGA, images
from benchmarks.common.tables import Table
from benchmarks.common.timing import measure
from benchmarks.likelihood.errors import captured, errors_of, turn_m
from transientcam_driver import Sequence as Capture
from transientcam_experiments.paper.bench import Bench
from transientcam_moments.reconstruction import NEIGHBOURS

SCENES: Final = ("wall", "mirrors", "corner")
ORDER: Final = 4
TAKES: Final = (1, 12)
SEED: Final = 1


def tables() -> Iterator[Table]:
    """Take the range of each scene by the likelihood, and time averaging beside the pass."""
    bench = Bench(seed=SEED)
    table = Table(
        "Range by the likelihood: median / 90 % / RMSE / bias, mm",
        ("scene", "takes", *NEIGHBOURS, "stated / mm", "beyond 3 deviations"),
        notes=["Of the edge-preserving average: median of the deviation that is stated."],
    )
    for scene in SCENES:
        for takes in TAKES:
            table.rows.append((scene, str(takes), *_errors(bench, scene, takes)))
    yield table
    yield _speed()


def _errors(bench: Bench, scene: str, takes: int) -> Iterator[str]:
    sequence = Capture(base_frequency_hz=23e6, harmonics=ORDER, takes=takes, zeroth="low-frequency")
    shot, gains, settings, truth = captured(bench, scene, sequence)
    usual, turn = replace(settings, estimator="likelihood"), turn_m(shot.base_frequency_hz)
    found = {
        name: tm.Reconstruction(
            shot.found.measured, replace(usual, neighbours=name), calibration=gains
        )
        for name in NEIGHBOURS
    }
    yield from (str(errors_of(each.range_m, truth, turn)) for each in found.values())
    kept = found["edge-preserving"]
    off_m = np.remainder(np.asarray(kept.range_m) - truth + turn / 2, turn) - turn / 2
    std_m = np.asarray(kept.range_std_m)
    known = np.isfinite(off_m)
    yield f"{1e3 * np.median(std_m[known]):.2f}"
    yield f"{np.mean(np.abs(off_m / std_m)[known] > 3):.1%}"


def _speed() -> Table:
    names = ("neighbours", "reconstruct", "measure", "smooth")
    tm.kernels.compile(harmonics=[ORDER], precisions=("float32",), names=names)
    table = Table(
        f"Time of a frame, m = {ORDER}, on one core, single precision",
        ("pixels", "edge-preserving", "pass of raw images", "ratio"),
    )
    for name, shape in (("163 x 120", PAPER), ("640 x 480", VGA)):
        raw = images(ORDER, shape)
        reconstructor = tm.Reconstructor(SETTINGS, calibration=np.ones(ORDER + 1))
        moments = np.asarray(reconstructor(raw).measured)
        noise = tm.noise.MomentNoise(np.ones(moments.shape, np.float32))
        averaging = measure(partial(tm.average_neighbours, moments, noise))
        one_pass = measure(partial(reconstructor, raw))
        ratio = f"{averaging.median_s / one_pass.median_s:.1f}"
        table.rows.append((name, str(averaging), str(one_pass), ratio))
    return table
