"""Range against the truth of simulated scenes, for the time that a capture takes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np

import transientcam_moments as tm
from benchmarks.likelihood.errors import COLUMNS, HEAD, errors_of, ranges, turn_m
from benchmarks.tables import Table
from transientcam_driver import Sequence as Capture
from transientcam_experiments.paper.bench import WITHOUT_OUTLIERS, Bench

BASE_HZ: Final = 23e6
SCENES: Final = ("wall", "mirrors", "corner", "corner-left", "translucent")
ORDERS: Final = (3, 4)
TAKES: Final = (1, 3, 12)
Zeroth = Literal["low-frequency", "estimated"]
ZEROTHS: Final[tuple[Zeroth, ...]] = ("low-frequency", "estimated")
SEED: Final = 1


def tables(
    scenes: Sequence[str] = SCENES, orders: Sequence[int] = ORDERS, takes: Sequence[int] = TAKES
) -> Iterator[Table]:
    """Capture each scene with the paper's make of device, calibrated, and hold it to the truth."""
    bench = Bench(seed=SEED)
    for scene in scenes:
        table = Table(
            f"{scene}: {HEAD}",
            ("m, takes", "capture / ms", *COLUMNS, "explained", "predicted / mm"),
            notes=[
                "Simulated camera `prototype`, its outliers off, all other errors on, calibrated; "
                "f = 23 MHz, smoothed by 0.6 pixels. explained: share of pixels whose chi-square "
                "noise exceeds in more than one of a thousand; predicted: median standard "
                "deviation by the likelihood's information matrix."
            ],
        )
        for m in orders:
            for count in takes:
                for zeroth in ZEROTHS if count == 1 else ZEROTHS[:1]:
                    table.rows.append(_row(bench, scene, m, count, zeroth))
        yield table


def _row(bench: Bench, scene: str, m: int, takes: int, zeroth: Zeroth) -> tuple[str, ...]:
    sequence = Capture(base_frequency_hz=BASE_HZ, harmonics=m, takes=takes, zeroth=zeroth)
    shot = bench.shot(scene, sequence, options=WITHOUT_OUTLIERS)
    gains = bench.calibration(sequence, options=WITHOUT_OUTLIERS).gains.planes
    base_hz = shot.base_frequency_hz
    settings = replace(shot.found.settings, sensor=tm.noise.Sensor())
    found = ranges(shot.found.measured, settings, calibration=gains)
    truth = np.where(shot.lit, shot.truth.range_m, np.nan)
    model = tm.Reconstruction(
        shot.found.measured, replace(settings, estimator="likelihood"), calibration=gains
    )
    std_mm = 1e3 * np.asarray(model.range_std_m)[shot.lit]
    return (
        f"{m}, {takes}" + (", no b_0" if zeroth == "estimated" else ""),
        f"{1e3 * shot.applied.capture_s:.0f}",
        *(str(errors_of(each, truth, turn_m(base_hz))) for each in found.values()),
        f"{model.likelihood.explained()[shot.lit].mean():.0%}",
        f"{np.nanmedian(std_mm):.1f}",
    )
