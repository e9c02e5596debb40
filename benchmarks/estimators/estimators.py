"""Run ``python -m benchmarks.estimators [--write]``: every technique, what it says and does.

``--write`` keeps the page as docs/estimators.md.
"""

import argparse
import tempfile
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import get_args

from rich.progress import Progress, TaskID

import transientcam_moments as tm
from benchmarks.common.machine import machine
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff.estimating import SAMPLE_PIXELS
from transientcam_moments.comparisons import TECHNIQUES, Technique
from transientcam_server.settings import Estimator, ReconstructionSettings

PAGE = Path(__file__).parents[1] / "docs" / "estimators.md"
SCENES = ("mirrors", "corner")
HARMONICS = (4, 8)
SEED = 1
REPETITIONS = 3


def main() -> None:
    """Measure, print the page, and with ``--write`` keep it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write docs/estimators.md")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = report(measured(Path(folder)))
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


def measured(folder: Path) -> list[tradeoff.Record]:
    """Run what the tradeoff measures of techniques."""
    tm.kernels.compile(harmonics=HARMONICS)
    records = tradeoff.Records(folder)
    grid = tradeoff.Grid((), HARMONICS)
    with Progress() as progress:
        for scene in SCENES:
            every = tradeoff.points_of(grid, scene=scene, repetitions=REPETITIONS, seed=SEED)
            points = [point for point in every if point.kind == "estimating"]
            task = progress.add_task(scene, total=len(points))
            tradeoff.measure(
                points, records, scene=scene, seed=SEED, progress=partial(_advance, progress, task)
            )
    return list(records)


def _advance(progress: Progress, task: TaskID, kind: str) -> None:
    progress.advance(task)


def report(records: Iterable[tradeoff.Record]) -> str:
    """Return the page."""
    results = list(records)
    lines = [
        "# Estimators",
        "",
        "Written by `python -m benchmarks.estimators --write` on",
        f"{machine()}.",
        "",
        *_INTRODUCTION,
        "| name | follows | returns | looks at | least m | daemon |",
        "|---|---|---|---|---|---|",
        *(_row(technique) for technique in TECHNIQUES.values()),
        "",
        *_OF_ANY_FREQUENCIES,
        "## What each takes for granted, costs, and how it fails",
        "",
    ]
    for technique in TECHNIQUES.values():
        lines += [
            f"**{technique.name}**, {technique.label}",
            "",
            f"- takes for granted: {technique.assumptions}",
            f"- costs: {technique.cost}",
            f"- fails: {technique.failure}",
            "",
        ]
    return "\n".join([*lines, *_measurements(results)]) + "\n"


_INTRODUCTION = (
    "The range of a frame is that of its first return. Which method finds it is the setting "
    "`reconstruction.estimator` of the daemon, `PUT /api/v1/reconstruction` while it runs, and "
    "`tm.Settings(estimator=...)` in Python. The daemon's default is `automatic`: "
    "`likelihood`, which errs least over the scenes of [likelihood.md](likelihood.md), "
    "and `pisarenko` until its kernel is compiled. The paper's own are `pisarenko`, as printed and "
    "the default of `tm.Settings`, and `maximum-entropy`; `pisarenko-merged` merges returns that "
    "noise split. All others are there to be compared with. "
    "Direct and indirect light are those of the estimator, too, and uniform light is what they "
    "leave of the brightness.",
    "",
    "`transientcam_moments.comparisons.TECHNIQUES` holds all of them in one form: "
    "`technique.estimate(moments)` gives an impulse response with `cumulative(phase_rad)`, "
    '`first_phase_rad()` and `separate()`. "After ..." says that a technique follows what is '
    "known of a publication whose text was not at hand; none is the authors' own implementation. "
    "None but the maximum entropy estimate looks at b_0.",
    "",
    "The daemon offers those that compute all pixels at once. The others solve an optimisation "
    "for each pixel and take seconds to minutes a frame; `coded` needs another measurement "
    "altogether (`comparisons.coded`). Where an estimator needs more harmonics than the sequence "
    "has, the daemon refuses whichever of the two was asked for last (`estimator-misfit`), and "
    "`tm.Reconstruction` raises a `ParameterError` that says how many it takes.",
    "",
)


_OF_ANY_FREQUENCIES = (
    "Two more are for [frequencies with gaps](cameras.md#fixed-frequencies), and take consecutive "
    "ones, too; they are not held against the others here.",
    "",
    "| name | follows | returns | looks at |",
    "|---|---|---|---|",
    "| `two-returns` | least squares over all pairs of returns (`tm.two_returns`) | 2 | any |",
    "| `unwrapped-phase` | least squares over all wrap counts (`tm.unwrap`) | 1 | any |",
    "",
)


def _row(technique: Technique) -> str:
    offered = "yes" if technique.name in get_args(Estimator) else "no"
    return (
        f"| `{technique.name}` | {technique.label} | {technique.returns} "
        f"| {technique.frequencies} | {technique.least_harmonics} | {offered} |"
    )


def _measurements(records: list[tradeoff.Record]) -> list[str]:
    lines = [
        "## Time and error on the same frames",
        "",
        "One single-take capture of a simulated scene by the simulated camera with its noise, over "
        "the emulated USB; the range is held against the truth "
        f"in {SAMPLE_PIXELS} pixels. Times are of a frame of 163 x 120 pixels, for techniques "
        "that go pixel by pixel those pixels' time multiplied; `sra-table` had its table already, "
        "`regularised` had no neighbours to look at. `transientcam tradeoff` measures the same on "
        "any scene.",
        "",
    ]
    for scene in SCENES:
        for m in HARMONICS:
            mine = [
                record
                for record in records
                if record.scene == scene and record.point["harmonics"] == m
            ]
            if mine:
                lines += _table(scene, m, mine)
    return lines


def _table(scene: str, m: int, records: list[tradeoff.Record]) -> list[str]:
    return [
        f"### {scene}, m = {m}",
        "",
        f"Closest to the truth in a typical pixel: {_best(records, 'range_median_m')}; in nine of "
        f"ten: {_best(records, 'range_p90_m')}. {_fewer_outliers(records)}",
        "",
        "| estimator | s a frame | median error / mm | 9 of 10 below / mm | off by > 0.1 m "
        "| no range |",
        "|---|---|---|---|---|---|",
        *(
            f"| `{record.point['estimator']}` | {_seconds(record)} "
            f"| {_scaled(record, 'range_median_m', 1e3)} | {_scaled(record, 'range_p90_m', 1e3)} "
            f"| {_scaled(record, 'range_outliers', 1, '{:.0%}')} "
            f"| {_scaled(record, 'range_missing', 1, '{:.0%}')} |"
            for record in records
        ),
        "",
    ]


def _best(records: list[tradeoff.Record], quantity: str) -> str:
    ranked = sorted(records, key=lambda each: each.values[quantity] or float("inf"))
    return " and ".join(f"`{record.point['estimator']}`" for record in ranked[:2])


def _fewer_outliers(records: list[tradeoff.Record]) -> str:
    """Say which have fewer outliers there than the default."""
    default = ReconstructionSettings().technique(noise_known=False)
    share = {str(each.point["estimator"]): each.values["range_outliers"] for each in records}
    ours = share[default] or 0.0
    fewer = [f"`{name}`" for name, value in share.items() if value is not None and value < ours]
    if not fewer:
        return f"None has fewer pixels off by more than 0.1 m than `{default}`."
    return f"Fewer pixels off by more than 0.1 m than `{default}`: {', '.join(fewer)}."


def _seconds(record: tradeoff.Record) -> str:
    return f"{record.values['seconds'] or 0.0:.2g}"


def _scaled(record: tradeoff.Record, name: str, factor: float, form: str = "{:.3g}") -> str:
    value = record.values[name]
    return "–" if value is None else form.format(value * factor)


if __name__ == "__main__":
    main()
