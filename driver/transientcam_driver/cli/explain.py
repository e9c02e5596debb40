"""The verb ``explain``: the effects that a scene and a sequence call for."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from transientcam_driver.cli.options import JsonOption
from transientcam_driver.entries.sim import resolution, scene_of
from transientcam_driver.errors import DriverError, SpecError
from transientcam_driver.handle import ExplainedEffect, Explanation
from transientcam_driver.plugin import CameraName
from transientcam_driver.sequence import Sequence
from transientcam_driver.simulation import world_of
from transientcam_driver.simulation.device import prototype

_BAD_USAGE = 2


def explain(
    scene: Annotated[
        str,
        typer.Argument(
            help="A scene's name or .toml, or the whole name of a simulated camera: "
            "mirrors, my.toml, 'sim:corner?device=prototype&ambient=on'."
        ),
    ],
    sequence: Annotated[
        Path | None, typer.Option("--sequence", help="A sequence document, as JSON.")
    ] = None,
    base_frequency_hz: Annotated[
        float | None, typer.Option("--base-frequency-hz", help="f, in Hz.")
    ] = None,
    harmonics: Annotated[int | None, typer.Option("--harmonics", help="m, from 1 to 32.")] = None,
    zeroth: Annotated[
        str | None, typer.Option("--zeroth", help="low-frequency, on-off or estimated.")
    ] = None,
    exposure_s: Annotated[
        float | None, typer.Option("--exposure-s", help="Of one image, in s.")
    ] = None,
    takes: Annotated[int | None, typer.Option("--takes", help="Takes to average.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Say which effects a scene calls for, why, how large each is, and what it costs."""
    options = {
        "base_frequency_hz": base_frequency_hz,
        "harmonics": harmonics,
        "zeroth": zeroth,
        "exposure_s": exposure_s,
        "takes": takes,
    }
    try:
        explanation = _explained(scene, _sequence(sequence, options))
    except DriverError as error:
        typer.echo(f"transientcam explain: {error}", err=True)
        raise typer.Exit(_BAD_USAGE) from error
    if as_json:
        typer.echo(json.dumps(explanation.to_document(), indent=2))
    else:
        _print(explanation)


def _sequence(path: Path | None, options: dict[str, Any]) -> Sequence:
    sequence = Sequence() if path is None else Sequence.from_document(_document(path))
    return replace(
        sequence, **{name: value for name, value in options.items() if value is not None}
    )


def _document(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SpecError(str(path), f"no sequence document: {error}") from error


def _explained(name: str, sequence: Sequence) -> Explanation:
    parsed = CameraName.parse(name if name.startswith(("sim:", "usb")) else f"sim:{name}")
    if parsed.kind != "sim":
        raise SpecError(name, "a real camera has no scene to explain")
    scene = scene_of(parsed).load()
    width, height = resolution(parsed)
    capabilities = prototype(serial="", width=width, height=height, bits=scene.sensor.bits)
    capabilities.validate(sequence)
    world = world_of(scene, width=width, height=height, readout_s=capabilities.streaming_readout_s)
    return world.explain(scene.name, sequence)


def _print(explanation: Explanation) -> None:
    console = Console()
    sequence = explanation.sequence
    console.print(
        f"{escape(explanation.scene)}, device {explanation.device}: "
        f"m = {sequence.harmonics} at {sequence.base_frequency_hz / 1e6:g} MHz, "
        f"{sequence.exposure_s * 1e3:g} ms, {sequence.images} images. "
        f"Noise floor of a moment: {explanation.floor_dn:.1f} DN; "
        f"an effect is called for above {explanation.threshold:g} of it.",
        soft_wrap=True,
    )
    table = Table(box=None)
    for heading in ("effect", "called", "choice", "size", "/ noise", "a frame"):
        table.add_column(heading, no_wrap=True)
    table.add_column("why")
    for each in explanation.effects:
        table.add_row(*_row(each))
    console.print(table)


def _row(each: ExplainedEffect) -> tuple[str, ...]:
    """One line; an effect that is built shows its name in bold."""
    name = f"[bold]{each.effect}[/bold]" if each.built else each.effect
    there = each.size_dn > 0
    return (
        name,
        "yes" if each.called_for else "no",
        each.choice,
        f"{each.size_dn:.2g} DN" if there else "-",
        f"{each.relative:.2g}" if there else "-",
        f"{each.cost_s * 1e3:.2g} ms" if each.cost_s else "-",
        escape(each.reason),
    )
