"""The verb ``paper`` of the ``transientcam`` command."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from transientcam_experiments.paper.page import Page


def paper(
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="Folder for the page and its pictures; other figures there stay."
        ),
    ],
    figures: Annotated[
        list[int] | None, typer.Argument(help="Numbers, as in 8 9.  [default: all there are]")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few takes, for a first look: other numbers.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of all chance.")] = 1,
    waveform: Annotated[
        Path | None,
        typer.Option(
            help="For figure 3 also a measured correlation function: .npy (rows, samples) over one "
            "period, opposite rows in pairs."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all numbers as JSON.")] = False,
) -> None:
    """Make the paper's figures with this software, and check what the paper says about each.

    Everything is captured from the simulated camera over its emulated USB, calibration included.
    """
    _require_matplotlib()
    from transientcam_experiments.paper import FIGURES, Bench
    from transientcam_experiments.paper.page import Page

    chosen = list(dict.fromkeys(figures or FIGURES))
    for number in chosen:
        if number not in FIGURES:
            known = ", ".join(map(str, FIGURES))
            raise typer.BadParameter(f"{number} is none of {known}", param_hint="FIGURES")
    bench = Bench(seed=seed, quick=quick, waveform=waveform)
    page = Page(output)
    console = Console(stderr=True)
    documents = []
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
    ) as progress:
        task = progress.add_task("figures", total=len(chosen))
        for number in chosen:
            progress.update(task, description=f"figure {number}")
            documents.append(_made(number, bench, page))
            progress.advance(task)
    if as_json:
        typer.echo(json.dumps(documents, ensure_ascii=False))
    else:
        for document in documents:
            _tell(console, document)
        console.print(f"See {page.path}", soft_wrap=True)


def _made(number: int, bench: Any, page: "Page") -> dict[str, Any]:
    from transientcam_experiments.paper import FIGURES, style
    from transientcam_experiments.paper.page import document_of

    figure = FIGURES[number]
    begin_s = time.process_time()  # whatever else the machine does
    made = figure.make(bench)
    picture = style.png(made.picture)
    seconds = time.process_time() - begin_s
    document = document_of(figure, made, seconds=seconds, quick=bench.quick, seed=bench.seed)
    page.add(document, picture)
    return document


def _tell(console: Console, document: dict[str, Any]) -> None:
    statements = document["statements"]
    hold = sum(each["passes"] for each in statements)
    heading = f"Figure {document['figure']}, {document['title']}"
    console.print(f"{heading}: {hold} of {len(statements)} statements hold", soft_wrap=True)
    for each in statements:
        if not each["passes"]:
            console.print(f"  differs: {each['says']} ({each['shown']})", soft_wrap=True)


def _require_matplotlib() -> None:
    from transientcam_server.errors.exceptions import MissingExtra

    try:
        import matplotlib  # noqa: F401 - only whether it is there
    except ModuleNotFoundError as error:
        raise MissingExtra("transientcam paper", "matplotlib", "plot") from error
