"""The verbs ``paper``, ``tradeoff`` and ``compare`` of the ``transientcam`` command.

What is heavy is imported when a verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from transientcam.cli.options import require_suffix
from transientcam.cli.terminal import Terminal, echo, progress_bars
from transientcam_server.cli.cluster import DaskOption, WorkersOption, cluster_client

if TYPE_CHECKING:
    from transientcam_experiments.tradeoff import Compared, Grid, Point, Records


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
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    waveform: Annotated[
        Path | None,
        typer.Option(
            help="For figure 3 also a measured correlation function: .npy (rows, samples) over one "
            "period, opposite rows in pairs."
        ),
    ] = None,
    workers: WorkersOption = None,
    dask: DaskOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all numbers as JSON.")] = False,
) -> None:
    """Make the paper's figures with this software, and check what the paper says about each.

    Everything is captured from the simulated camera over its emulated USB, calibration included.
    `--workers` and `--dask` make figures on a cluster, each worker another one.
    """
    from transientcam_server.offline import plot

    plot.require("transientcam paper")
    from transientcam_experiments.paper import FIGURES, Bench, making
    from transientcam_experiments.paper.page import Page

    chosen = list(dict.fromkeys(figures or FIGURES))
    for number in chosen:
        if number not in FIGURES:
            known = ", ".join(map(str, FIGURES))
            raise typer.BadParameter(f"{number} is none of {known}", param_hint="FIGURES")
    page = Page(output)
    console = Terminal(stderr=True)
    documents = {}
    with ExitStack() as stack:
        if workers is not None or dask is not None:
            client = stack.enter_context(cluster_client(workers, dask, console))
            figures_made = _made_on(client, chosen, seed, quick, waveform)
        else:
            bench = Bench(seed=seed, quick=quick, waveform=waveform)
            figures_made = ((number, making.made(number, bench)) for number in chosen)
        results = stack.enter_context(closing(figures_made))
        progress = stack.enter_context(progress_bars(console=console, counted=True))
        task = progress.add_task("figures", total=len(chosen))
        for number, (document, picture) in results:
            page.add(document, picture)
            documents[number] = document
            progress.advance(task)
    ordered = [documents[number] for number in chosen]
    if as_json:
        echo(json.dumps(ordered, ensure_ascii=False))
    else:
        for document in ordered:
            _print_statements(console, document)
        console.print(f"See {page.path}")


def _made_on(
    client: Any, chosen: list[int], seed: int, quick: bool, waveform: Path | None
) -> Generator[tuple[int, tuple[dict[str, Any], bytes]], None, None]:
    """Yield the number, the document and the picture of each figure as a cluster has made it."""
    from transientcam_experiments.paper.making import made_by_worker
    from transientcam_server.offline import completed, installed

    # workers may run in another directory
    place = None if waveform is None else waveform.resolve()
    tasks = [(number, seed, quick, place, installed()) for number in chosen]
    with closing(completed(client, made_by_worker, tasks)) as results:
        for task, result in results:
            yield task[0], result


def _print_statements(console: Terminal, document: dict[str, Any]) -> None:
    statements = document["statements"]
    hold = sum(each["passes"] for each in statements)
    heading = f"Figure {document['figure']}, {document['title']}"
    console.print(f"{heading}: {hold} of {len(statements)} statements hold")
    for each in statements:
        if not each["passes"]:
            console.print(f"  differs: {each['says']} ({each['shown']})")


def tradeoff(
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", help="Folder for results; points already there are skipped."
        ),
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
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    workers: WorkersOption = None,
    dask: DaskOption = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print what was written as JSON.")
    ] = False,
) -> None:
    """Measure what accuracy costs in time on scenes whose truth is known.

    `--workers` and `--dask` capture on a cluster; what is timed is measured here afterwards, alone.

    An interrupted run loses nothing: tables, plots and page show what was measured so far, and
    the same command goes on where it stopped.
    """
    from transientcam_experiments import tradeoff as experiment
    from transientcam_server.offline import plot

    plot.require("transientcam tradeoff")
    grid = experiment.load_grid(sequence_grid)
    scenes = scene or ["mirrors"]
    points = {
        name: experiment.points_of(grid, scene=name, repetitions=repetitions, seed=seed)
        for name in scenes
    }
    records = experiment.Records(output)
    console = Terminal(stderr=True)
    interrupted = False
    try:
        if workers is not None or dask is not None:
            kept = {"repetitions": repetitions, "seed": seed}
            _capture_on(workers, dask, console, grid, scenes, records, **kept)
        _measure_here(console, points, records, seed=seed)
    except KeyboardInterrupt:
        # what is in the file, which may have a point that is not in these records yet
        records, interrupted = experiment.Records(output), True
    written = experiment.report(output, records) if len(records) else []
    if as_json:
        document = {"points": len(records), "written": [str(path) for path in written]}
        echo(json.dumps(document))
    else:
        console.print(f"{len(records)} points; see {output / 'index.html'}")
    if interrupted:
        console.print("Interrupted. The same command goes on where it stopped.")
        raise typer.Exit(130)


def _capture_on(
    workers: int | None,
    dask: str | None,
    console: Terminal,
    grid: "Grid",
    scenes: list[str],
    records: "Records",
    **kept: int,
) -> None:
    """Capture on a cluster what is left of all scenes; ``kept`` are repetitions and seed."""
    from transientcam_experiments.tradeoff.clustered import measure_on

    with (
        cluster_client(workers, dask, console) as client,
        progress_bars(console=console, counted=True) as progress,
    ):
        for name in scenes:
            task = progress.add_task(f"{name}, captures", total=None)
            steps = _steps(progress, task)
            measure_on(client, grid, records, scene=name, progress=steps, **kept)


def _steps(progress: Any, task: Any) -> Callable[[str], None]:
    return lambda _: progress.advance(task)


def _measure_here(
    console: Terminal, points: Mapping[str, "list[Point]"], records: "Records", *, seed: int
) -> None:
    """Measure in this process what is left of all scenes."""
    import transientcam_moments as tm
    from transientcam_experiments import tradeoff as experiment

    with progress_bars(console=console, counted=True) as progress:
        left = (point for each in points.values() for point in each if point.key not in records)
        if any(point.kind == "computing" for point in left):  # only times need compiled kernels
            compiling = progress.add_task("compiling kernels", total=None)
            tm.kernels.compile(
                progress=lambda done, total, _: progress.update(
                    compiling, completed=done, total=total
                )
            )
            progress.remove_task(compiling)
        for name, each in points.items():
            task = progress.add_task(name, total=len(each))
            experiment.measure(
                each, records, scene=name, seed=seed, progress=_steps(progress, task)
            )


def compare(
    estimators: Annotated[
        list[str],
        typer.Argument(help="Names: those of docs/estimators.md, or of another package's."),
    ],
    against: Annotated[
        list[str] | None,
        typer.Option(help="What to hold them against; may be repeated.  [default: all fast ones]"),
    ] = None,
    scene: Annotated[
        list[str] | None,
        typer.Option(
            help="A scene of `transientcam scenes`, a .toml or measured:FILE.npz; may be repeated."
            "  [default: five of them]"
        ),
    ] = None,
    harmonics: Annotated[int, typer.Option(min=1, max=32, help="m, of the sequence.")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")] = 1,
    plot: Annotated[Path | None, typer.Option(help="Also draw the errors into this .png.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all numbers as JSON.")] = False,
) -> None:
    """Hold estimators against the built-in ones on scenes whose truth is known.

    All see the same moments, with the noise of the simulated camera. Exits with 1 where one of
    ESTIMATORS fails on a scene.
    """
    from transientcam_experiments import tradeoff as experiment
    from transientcam_moments.comparisons import PLUGINS, TECHNIQUES
    from transientcam_server.offline import plot as pictures

    if plot is not None:
        require_suffix(plot, ".png", hint="--plot")
        pictures.require("--plot")
    names = list(dict.fromkeys((*estimators, *(against or experiment.rivals(harmonics)))))
    known = [each.name for each in TECHNIQUES.values() if each.measures == "moments"]
    for name in names:
        if name not in (*known, *PLUGINS.names()):
            every = ", ".join((*known, *PLUGINS.names()))
            raise typer.BadParameter(f"{name!r} is none of {every}", param_hint="ESTIMATORS")
    scenes = scene or list(experiment.SCENES)
    found = []
    with progress_bars(console=Terminal(stderr=True), counted=True) as progress:
        task = progress.add_task("estimators before scenes", total=len(scenes) * len(names))
        for each in experiment.compare(names, scenes, harmonics=harmonics, seed=seed):
            found.append(each)
            progress.advance(task)
    echo(json.dumps([asdict(each) for each in found]) if as_json else _compared(found))
    if plot is not None:
        experiment.draw(plot, found)
    if any(each.failed is not None and each.estimator in estimators for each in found):
        raise typer.Exit(code=1)


_COLUMNS: Final = {
    "range_median_m": 1e3,
    "range_p90_m": 1e3,
    "range_outliers": 100.0,
    "range_missing": 100.0,
    "seconds": 1e3,
}


def _compared(found: "list[Compared]") -> str:
    """Return a table: a block a scene, a line an estimator, the smallest errors first."""
    lines = []
    for scene in dict.fromkeys(each.scene for each in found):
        head = "error of the range, mm: median, p90; % off by > 10 cm; % without"
        lines += [f"{scene}: {head}; ms a frame in NumPy, uncompiled, timed once"]
        here = [each for each in found if each.scene == scene]
        for each in sorted(here, key=lambda one: one.values.get("range_median_m") or 1e9):
            v = each.values
            figures = " ".join(
                f"{'-':>8}" if v.get(key) is None else f"{(v[key] or 0.0) * factor:8.3g}"
                for key, factor in _COLUMNS.items()
            )
            lines.append(f"  {each.estimator:<18} {each.failed or figures}")
    return "\n".join(lines)
