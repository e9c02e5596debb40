"""Every technique, what it says of itself, and what it does on the same frames."""

import itertools
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import transientcam_moments as tm
from benchmarks.accuracy.tradeoffs import measure, scaled
from benchmarks.common.tables import Cell, Column, Table
from transientcam_experiments import tradeoff
from transientcam_moments.comparisons import TECHNIQUES, Technique
from transientcam_server.settings import Estimator

SCENES = ("mirrors", "corner")
HARMONICS = (4, 8)
SEED = 1
REPETITIONS = 3


def tables() -> Iterator[Table]:
    """Measure time and error on the same frames."""
    with tempfile.TemporaryDirectory() as folder:
        yield from _tables(measured(Path(folder)))


def techniques() -> Iterator[Table]:
    """State what each technique says of itself."""
    columns = ("name", "follows", "returns", "looks at", "least m", "daemon")
    yield Table("", columns, [_row(technique) for technique in TECHNIQUES.values()])
    said = [
        f"- **{each.name}**, {each.label}. Takes for granted: {each.assumptions} Costs: "
        f"{each.cost} Fails: {each.failure}"
        for each in TECHNIQUES.values()
    ]
    yield Table("What each takes for granted, costs, and how it fails", text=said)


def measured(folder: Path) -> list[tradeoff.Record]:
    """Run what the tradeoff measures of techniques."""
    tm.kernels.compile(harmonics=HARMONICS)
    records = tradeoff.Records(folder)
    grid = tradeoff.Grid((), HARMONICS)
    for scene in SCENES:
        every = tradeoff.points_of(grid, scene=scene, repetitions=REPETITIONS, seed=SEED)
        points = [point for point in every if point.kind == "estimating"]
        measure(points, records, scene=scene, seed=SEED)
    return list(records)


def _row(technique: Technique) -> tuple[Cell, ...]:
    return (
        f"`{technique.name}`",
        technique.label,
        technique.returns,
        technique.frequencies,
        technique.least_harmonics,
        "yes" if technique.name in get_args(Estimator) else "no",
    )


def _tables(records: list[tradeoff.Record]) -> Iterator[Table]:
    for scene, m in itertools.product(SCENES, HARMONICS):
        yield _table(
            f"{scene}, m = {m}",
            [each for each in records if each.scene == scene and each.point["harmonics"] == m],
        )


def _table(title: str, records: list[tradeoff.Record]) -> Table:
    columns = {
        "seconds": (1.0, Column("s a frame", ".2g")),
        "range_median_m": (1e3, Column("median error / mm", ".3g")),
        "range_p90_m": (1e3, Column("9 of 10 below / mm", ".3g")),
        "range_outliers": (1.0, Column("off by > 0.1 m", ".0%")),
        "range_missing": (1.0, Column("no range", ".0%")),
    }
    text = (
        f"Closest to the truth in a typical pixel: {_best(records, 'range_median_m')}; in nine of "
        f"ten: {_best(records, 'range_p90_m')}. {_fewer_outliers(records)}"
    )
    rows = [
        (
            f"`{record.point['estimator']}`",
            *(scaled(record, name, factor) for name, (factor, _) in columns.items()),
        )
        for record in records
    ]
    return Table(title, ("estimator", *(each for _, each in columns.values())), rows, text=[text])


def _best(records: list[tradeoff.Record], quantity: str) -> str:
    ranked = sorted(records, key=lambda each: each.values[quantity] or float("inf"))
    return " and ".join(f"`{record.point['estimator']}`" for record in ranked[:2])


def _fewer_outliers(records: list[tradeoff.Record]) -> str:
    """Say which have fewer outliers there than the default."""
    default = "pisarenko"
    share = {str(each.point["estimator"]): each.values["range_outliers"] for each in records}
    ours = share[default] or 0.0
    fewer = [f"`{name}`" for name, value in share.items() if value is not None and value < ours]
    if not fewer:
        return f"None has fewer pixels off by more than 0.1 m than `{default}`."
    return f"Fewer pixels off by more than 0.1 m than `{default}`: {', '.join(fewer)}."
