"""Measure the speed of the reconstruction: ``python -m benchmarks [TOPIC ...] [--write]``."""

import argparse
import importlib
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, TextColumn, TimeElapsedColumn

import transientcam_moments as tm
from benchmarks.machine import machine
from benchmarks.tables import Table, write_page

TOPICS = (
    "density",
    "reconstruction",
    "stages",
    "pisarenko",
    "cumulative",
    "scaling",
    "compiling",
)
PAGE = Path(__file__).parents[1] / "docs" / "benchmarks.md"


def main() -> None:
    """Measure the topics asked for, print tables, and write docs/benchmarks.md where requested."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("topics", nargs="*", metavar="TOPIC", help=f"of {', '.join(TOPICS)}")
    parser.add_argument("--write", action="store_true", help=f"write docs/{PAGE.name} anew")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.topics) - set(TOPICS))
    if unknown:
        parser.error(f"unknown topic {unknown[0]}, choose from {', '.join(TOPICS)}")
    console = Console()
    if not console.is_terminal:
        console = Console(width=120)
    console.print(f"On: {machine()}", highlight=False)
    _compile(console)
    tables: list[Table] = []
    for topic in arguments.topics or TOPICS:
        for table in importlib.import_module(f"benchmarks.{topic}").tables():
            table.show(console)
            tables.append(table)
    if arguments.write:
        command = " ".join(["python -m benchmarks", *arguments.topics, "--write"])
        write_page(PAGE, tables, machine=machine(), command=command)
        console.print(f"Written to {PAGE}")


def _compile(console: Console) -> None:
    columns = (TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("compiling")

        def show(done: int, total: int, name: str) -> None:
            progress.update(task, description=f"compiling {done}/{total} {name}")

        tm.kernels.compile(progress=show)


if __name__ == "__main__":
    main()
