"""Run measurements: ``python -m benchmarks [NAME or PAGE ...] [--option ...] [--write]``.

``--write`` keeps what is found as docs/measured/records/NAME.json, and writes the page of it.
``python -m benchmarks render [PAGE ...]`` writes pages from the records that there are. Without a
name the speed of the reconstruction is measured, everything in one run on the same data.
"""

import argparse
import importlib
import inspect
import sys
import tempfile
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from itertools import takewhile
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from rich.console import Console
from rich.table import Table as ScreenTable

from benchmarks.catalogue import MEASUREMENTS, Measurement
from benchmarks.common.machine import commit_of, machine
from benchmarks.common.records import DOCS, ROOT, Record, page_of, render
from benchmarks.common.tables import Table

Function = Callable[..., Iterable[Table] | None]
_OWN = ("write", "figures")
"""Arguments of functions that are no options: whether to write, and the folder of pictures."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what is named."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    names = list(takewhile(lambda word: not word.startswith("-"), words))
    if names[:1] == ["render"]:
        render(sorted({page_of(each) for each in chosen(names[1:] or ["all"]) if each.page}))
        return
    described = __doc__ if names else f"{__doc__}\n\n{_listed()}"
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=described,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="a measurement, a page, or all")
    parser.add_argument("--write", action="store_true", help="keep the record, write the page")
    try:
        measurements = chosen(names or ["benchmarks"])
    except LookupError as error:
        parser.error(str(error))
    functions = [(each, function_of(each)) for each in measurements]
    options: dict[str, inspect.Parameter] = {}
    for measurement, function in functions:
        options |= options_of(function)
        parser.epilog = f"{measurement.name}: {inspect.getdoc(function)}"
    for name, option in options.items():
        parser.add_argument(f"--{name.replace('_', '-')}", **_kind(option))
    given = vars(parser.parse_args(words))
    for measurement, function in functions:
        asked = {name: given[name] for name in options_of(function) if given[name] is not None}
        run(measurement, function, asked, write=given["write"])


def chosen(names: Iterable[str]) -> list[Measurement]:
    """Return measurements by their names, or those of pages; ``all`` are those of all pages.

    Raises LookupError naming what is neither.
    """
    found: dict[str, Measurement] = {}
    for name in names:
        of_page = [
            each
            for each in MEASUREMENTS.values()
            if not each.by_hand and (name == "all" or Path(each.page or "").name == name)
        ]
        word = name.replace("-", "_")
        if not of_page and word not in MEASUREMENTS:
            raise LookupError(f"no measurement and no page is called {name}; see --help")
        found |= {each.name: each for each in of_page or [MEASUREMENTS[word]]}
    return list(found.values())


def function_of(measurement: Measurement) -> Function:
    """Import the function of a measurement."""
    module = importlib.import_module(f"benchmarks.{measurement.module}")
    function: Function = getattr(module, measurement.function)
    return function


def options_of(function: Function) -> dict[str, inspect.Parameter]:
    """Return the arguments of a function that are its options, by their names."""
    hints = get_type_hints(function)
    parameters = inspect.signature(function).parameters
    return {
        name: parameter.replace(annotation=hints[name])
        for name, parameter in parameters.items()
        if name not in _OWN
    }


def _kind(option: inspect.Parameter) -> dict[str, Any]:
    """Return how argparse reads an option: a flag, a value, or one or more of them."""
    kind = option.annotation
    if kind is bool:
        return {"action": "store_true", "default": None, "help": "default: no"}
    if get_origin(kind) in (Union, types.UnionType):
        (kind,) = (each for each in get_args(kind) if each is not type(None))
    several = {}
    if get_origin(kind) is tuple:
        kind, several = get_args(kind)[0], {"nargs": "+"}
    if option.default is inspect.Parameter.empty:
        return several | {"type": kind, "required": True}
    return several | {"type": kind, "help": f"default: {option.default}"}


def run(
    measurement: Measurement,
    function: Function,
    asked: Mapping[str, Any],
    *,
    write: bool,
    docs: Path = DOCS,
) -> None:
    """Run a measurement, show its tables, and keep them if they are to be kept."""
    console = Console() if sys.stdout.isatty() else Console(width=160)
    console.print(f"{measurement.name}, on: {machine()}", highlight=False)
    begun = datetime.now(UTC)
    wanted = inspect.signature(function).parameters
    with tempfile.TemporaryDirectory() as folder:
        own = {"write": write, "figures": docs / "figures" if write else Path(folder)}
        given = {**asked, **{n: own[n] for n in _OWN if n in wanted}}
        tables = []
        for table in function(**given) or ():
            show(table, console)
            tables.append(table)
    if write and measurement.page is not None:
        record = Record(
            measurement.name,
            command(measurement, asked),
            commit_of(ROOT),
            f"{begun:%Y-%m-%d}",
            machine() if measurement.timed else None,
            tables,
        )
        path, page = record.written(docs), page_of(measurement, docs)
        render([page], docs)
        console.print(f"Written to {path} and {page}")


def command(measurement: Measurement, asked: Mapping[str, Any]) -> str:
    """Return what repeats a measurement; of paths, which are of one machine, their names."""
    words = ["python -m benchmarks", measurement.name]
    for name, value in asked.items():
        words.append(f"--{name.replace('_', '-')}")
        for each in value if isinstance(value, list) else [value]:
            if each is not True:
                words.append(name.upper() if isinstance(each, Path) else str(each))
    return " ".join([*words, "--write"])


def show(table: Table, console: Console) -> None:
    """Print a table."""
    if table.columns:
        head, *rows = table.shown()
        drawn = ScreenTable(title=table.title, title_justify="left", title_style="bold")
        for index, name in enumerate(head):
            drawn.add_column(name, justify="right" if index else "left")
        for row in rows:
            drawn.add_row(*row)
        console.print(drawn)
    for note in (*table.text, *table.notes):
        console.print(f"  {note}", style="dim", highlight=False)
    console.print()


def _listed() -> str:
    lines = [f"{each.name:24}{each.page or ''}" for each in MEASUREMENTS.values()]
    return "\n".join(["measurements, and their pages in docs/:", *lines])


if __name__ == "__main__":
    main()
