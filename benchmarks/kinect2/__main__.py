"""Measure decoder and estimators of a Kinect v2: ``python -m benchmarks.kinect2 [--write]``.

With ``--write`` all goes into docs/kinect2.md. The frames are synthetic, and so is their noise;
TRANSIENTCAM_TEST_DATA names the folder that has them.
"""

import argparse
from pathlib import Path
from typing import Final

from rich.console import Console

from benchmarks.common.machine import machine
from benchmarks.kinect2 import corner, decoding, returns, seen

PAGE: Final = Path(__file__).parents[2] / "docs" / "kinect2.md"
_MARKS: Final = ("<!-- measured: begin -->", "<!-- measured: end -->")


def main() -> None:
    """Print the tables, or write them into the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kinect2", description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write them into docs/{PAGE.name}")
    write = parser.parse_args().write
    console = Console(width=140)
    tables = []
    for make in (
        returns.two_returns,
        returns.separations,
        returns.enough,
        returns.one_return,
        decoding.differences,
        decoding.speed,
    ):
        tables.append(make())
        tables[-1].show(console)
    captured = corner.captured()
    tables[:0] = [corner.table(captured), seen.table()]
    for table in tables[:2]:
        table.show(console)
    if write:
        corner.draw(captured, PAGE.parent / "figures" / "kinect2-corner.png")
        before, rest = PAGE.read_text(encoding="utf-8").split(_MARKS[0])
        _, after = rest.split(_MARKS[1])
        body = "\n".join(each.markdown() for each in tables)
        written = f"Written by `python -m benchmarks.kinect2 --write`; speeds on: {machine()}."
        page = f"{before}{_MARKS[0]}\n{body}\n{written}\n{_MARKS[1]}{after}"
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
