"""Measure the simulation: ``OMP_NUM_THREADS=1 python -m benchmarks.simulation [--write]``."""

import argparse
from pathlib import Path

from benchmarks.common.corner import range_errors
from benchmarks.common.machine import machine
from benchmarks.simulation import accuracy, bounces
from benchmarks.simulation.accuracy import SEQUENCES, accuracy_lines
from benchmarks.simulation.bounces import bounce_lines
from benchmarks.simulation.costs import (
    BARRED,
    SCENES,
    SIZES,
    VIDEO,
    cost_lines,
    measure_effects,
    measure_scenes,
)
from benchmarks.simulation.noise import noise_lines
from benchmarks.simulation.page import range_lines, rule_lines
from benchmarks.simulation.scenes import BUILT_IN, unseen
from transientcam_driver.simulation.light.lanes import LANES

PAGE = Path(__file__).parents[2] / "docs" / "simulation.md"
CORNERS = (("corner", "anywhere"), ("corner", "crease"), ("corner-left", "anywhere"))


def main() -> None:
    """Measure, print, and with ``--write`` keep the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name}")
    parser.add_argument("--small", action="store_true", help="only 163 x 120, and only video")
    arguments = parser.parse_args()
    LANES.compile_now()  # rather than beside what is measured
    costs = [
        each
        for size in SIZES[: 1 if arguments.small else None]
        for each in measure_scenes(SCENES if size == SIZES[0] else BARRED, size)
    ]
    effects = {name: measure_effects(name, SIZES[0]) for name in ("mirrors", "visitor")}
    left_out = [
        accuracy.measure(name, sequence)
        for name in (*BUILT_IN, *unseen())
        for sequence in list(SEQUENCES)[: 1 if arguments.small else None]
    ]
    lines = [
        "# What the simulated camera costs, and how true it is",
        "",
        "Written by `OMP_NUM_THREADS=1 python -m benchmarks.simulation --write` on",
        f"{machine()}.",
        "",
        *cost_lines(costs, effects),
        *rule_lines(VIDEO),
        *accuracy_lines(left_out),
        *bounce_lines([bounces.measure(*each) for each in CORNERS]),
        *noise_lines(),
        *range_lines(range_errors()),
    ]
    page = "\n".join(lines)
    print(page)
    if arguments.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
