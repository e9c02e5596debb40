"""Range against the truth of simulated scenes, for the time that a capture takes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final, Literal

import numpy as np

import transientcam_moments as tm
from benchmarks.common.measured_scenes import composite_scene, cornell_scene
from benchmarks.common.tables import Table
from benchmarks.likelihood.errors import (
    COLUMNS,
    ESTIMATORS,
    HEAD,
    Errors,
    captured,
    errors_of,
    ranges,
    turn_m,
)
from transientcam_driver import Sequence as Capture
from transientcam_experiments.paper.bench import Bench

SCENES: Final = ("wall", "mirrors", "corner", "corner-left", "translucent")
ORDERS: Final = (3, 4, 8)
TAKES: Final = (1, 3, 12)
TAKES_OF_MANY: Final = (1, 3)
"""Of more than `MOST_OF_SHORT` harmonics: a capture takes long already."""
MOST_OF_SHORT: Final = 4
Zeroth = Literal["low-frequency", "estimated"]
ZEROTHS: Final[tuple[Zeroth, ...]] = ("low-frequency", "estimated")
SEED: Final = 1


@dataclass
class Won:
    """How an estimator did over all captures."""

    ratios: list[tuple[float, ...]] = field(default_factory=list)
    """Of its error over the least one of a capture: median, 90 % and RMSE, each."""
    best: list[tuple[bool, ...]] = field(default_factory=list)
    """In how many captures each of these is the least one."""


def tables() -> Iterator[Table]:
    """Capture each scene with the paper's model of device, calibrated, and hold it to the truth.

    Last comes how each estimator did over all of them.
    """
    with TemporaryDirectory() as folder:
        scenes = {name: name for name in SCENES} | _of_others(Path(folder))
        yield from _tables_of(scenes)


def _of_others(folder: Path) -> dict[str, str]:
    """Return the scenes of measured and rendered responses, by their names; says what is absent."""
    found = {
        "composite of measured responses": composite_scene(folder),
        "Cornell box, rendered": cornell_scene(),
    }
    for name in (name for name, scene in found.items() if scene is None):
        print(f"No {name}: TRANSIENTCAM_TEST_DATA names no folder that has it.")
    return {name: scene for name, scene in found.items() if scene is not None}


def _tables_of(scenes: Mapping[str, str]) -> Iterator[Table]:
    bench = Bench(seed=SEED)
    won = {name: Won() for name in COLUMNS}
    for name, scene in scenes.items():
        table = Table(
            f"{name}: {HEAD}", ("m, takes", "capture / ms", *COLUMNS, "explained", "predicted / mm")
        )
        for m in ORDERS:
            for count in TAKES if m <= MOST_OF_SHORT else TAKES_OF_MANY:
                for zeroth in ZEROTHS if count == 1 else ZEROTHS[:1]:
                    table.rows.append(_row(bench, scene, m, count, zeroth, won))
        yield table
    yield summary(won)


def summary(won: Mapping[str, Won]) -> Table:
    """Return how each estimator did over all captures."""
    table = Table(
        "All captures: error over that of the best estimator",
        ("estimator", "median", "90 %", "RMSE", "all three", "best in"),
        notes=[
            "Geometric means over captures, each error over the least one of that capture; best "
            "in: share of captures in which median, 90 % and RMSE are the least."
        ],
    )
    for name, each in won.items():
        typical = np.exp(np.log(each.ratios).mean(axis=0))
        shares = np.mean(each.best, axis=0)
        table.rows.append(
            (
                name,
                *(f"{value:.2f}" for value in typical),
                f"{np.exp(np.log(typical).mean()):.2f}",
                " / ".join(f"{share:.0%}" for share in shares),
            )
        )
    return table


def note(won: Mapping[str, Won], errors: Mapping[str, Errors]) -> None:
    """Add the errors of one capture, by the names of the columns."""
    sizes = {name: (each.median_mm, each.p90_mm, each.rmse_mm) for name, each in errors.items()}
    least = np.min(list(sizes.values()), axis=0)
    for name, size in sizes.items():
        won[name].ratios.append(tuple(np.array(size) / least))
        won[name].best.append(tuple(np.array(size) <= least))


def _row(
    bench: Bench, scene: str, m: int, takes: int, zeroth: Zeroth, won: dict[str, Won]
) -> tuple[str, ...]:
    base_hz = 23e6 if m <= MOST_OF_SHORT else 11.5e6
    sequence = Capture(base_frequency_hz=base_hz, harmonics=m, takes=takes, zeroth=zeroth)
    shot, gains, settings, truth = captured(bench, scene, sequence)
    base_hz = shot.base_frequency_hz
    found = ranges(shot.found.measured, settings, calibration=gains)
    errors = {
        ESTIMATORS[name]: errors_of(each, truth, turn_m(base_hz)) for name, each in found.items()
    }
    note(won, errors)
    model = tm.Reconstruction(
        shot.found.measured, replace(settings, estimator="likelihood"), calibration=gains
    )
    std_mm = 1e3 * np.asarray(model.range_std_m)[shot.truth.lit]
    return (
        f"{m}, {takes}" + (", no b_0" if zeroth == "estimated" else ""),
        f"{1e3 * shot.applied.capture_s:.0f}",
        *(str(each) for each in errors.values()),
        f"{model.likelihood.explained()[shot.truth.lit].mean():.0%}",
        f"{np.nanmedian(std_mm):.1f}",
    )
