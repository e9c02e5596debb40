"""The verb ``compile`` of the ``transientcam`` command."""

import json
from typing import Annotated

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import Terminal, echo, progress_bars


def compile_kernels(
    harmonics: Annotated[
        list[int], typer.Option(min=1, max=32, help="Orders m to compile for; may be repeated.")
    ] = [3, 4, 8],  # noqa: B006 - typer copies it
    as_json: JsonOption = False,
) -> None:
    """Compile the kernels of the reconstruction now, as when an image or a package is built."""
    import transientcam_moments as tm

    if not tm.kernels.state()["enabled"]:
        if as_json:
            echo(json.dumps(tm.kernels.state()))
        else:
            echo("Kernels are off (TRANSIENTCAM_KERNELS); everything is left to NumPy.")
        return
    console = Terminal(stderr=as_json)
    with progress_bars(console=console) as progress:
        task = progress.add_task("compiling", total=None)

        def advance(done: int, total: int, name: str) -> None:
            progress.update(task, completed=done, total=total, description=name or "compiled")

        tm.kernels.compile(harmonics=harmonics, progress=advance)
    state = tm.kernels.state()
    if as_json:
        echo(json.dumps(state))
    else:
        for failure in state["failed"]:
            console.print(f"failed: {failure}")
        console.print(f"{len(state['compiled'])} kernels are ready.")
    if state["failed"]:
        raise typer.Exit(code=1)
