"""The verbs ``tradeoff`` and ``plan`` of the ``transientcam`` command."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


def tradeoff(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for results; what it holds is not redone."),
    ],
    scene: Annotated[
        list[str] | None,
        typer.Option(
            help="A scene of `transientcam scenes`, a .toml or measured:FILE.npz; may be repeated."
            "  [default: mirrors]"
        ),
    ] = None,
    sequence_grid: Annotated[
        str, typer.Option(help="paper, quick, or a .toml with [[sequence]] tables.")
    ] = "paper",
    repetitions: Annotated[int, typer.Option(min=1, help="Captures a point.")] = 5,
    seed: Annotated[int, typer.Option(min=0, help="Of all chance.")] = 1,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as JSON.")
    ] = False,
) -> None:
    """Measure what accuracy costs in time on scenes whose truth is known.

    An interrupted run loses nothing: tables, plots and page are made of what is there, and the
    same command goes on where it stopped.
    """
    import transientcam_moments as tm

    from transientcam_server import tradeoff as measuring
    from transientcam_server.tradeoff import plots

    plots.require()
    grid = measuring.load_grid(sequence_grid)
    scenes = scene or ["mirrors"]
    points = {
        name: measuring.points_of(grid, scene=name, repetitions=repetitions, seed=seed)
        for name in scenes
    }
    records = measuring.Records(output)
    console = Console(stderr=True)
    interrupted = False
    with _progress(console) as progress:
        if any(point.key not in records for each in points.values() for point in each):
            compiling = progress.add_task("compiling kernels", total=None)
            tm.kernels.compile(
                progress=lambda done, total, _: progress.update(
                    compiling, completed=done, total=total
                )
            )
            progress.remove_task(compiling)
        try:
            for name, each in points.items():
                task = progress.add_task(name, total=len(each))
                measuring.measure(
                    each,
                    records,
                    scene=name,
                    seed=seed,
                    progress=partial(_advance, progress, task),
                )
        except KeyboardInterrupt:
            interrupted = True
        written = measuring.report(output, records) if len(records) else []
    if as_json:
        document = {"points": len(records), "written": [str(path) for path in written]}
        typer.echo(json.dumps(document))
    else:
        console.print(f"{len(records)} points; see {output / 'index.html'}")
    if interrupted:
        console.print("Interrupted. The same command goes on where it stopped.")
        raise typer.Exit(130)


def _advance(progress: Progress, task: TaskID, kind: str) -> None:
    progress.advance(task)


@contextmanager
def _progress(console: Console) -> Iterator[Progress]:
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        yield progress
