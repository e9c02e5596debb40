"""The verb ``explain``: the effects that a scene and a sequence call for."""

import json
import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from transientcam.cli.options import JsonOption
from transientcam.cli.terminal import echo
from transientcam_driver.camera import CameraName, ExplainedEffect, Explanation
from transientcam_driver.errors import DriverError, SpecError
from transientcam_driver.sequence import Sequence
from transientcam_driver.texts import read_text
from transientcam_simulation import list_scenes, world_of
from transientcam_simulation.effects import NOISE, Quantisation
from transientcam_simulation.emulated import MEASURED, prototype
from transientcam_simulation.entries.sim import resolution, scene_of

_BAD_USAGE = 2
_COLUMNS = 80
_ALWAYS = [each.name for each in (*NOISE, Quantisation)]


def explain(
    scene: Annotated[
        str,
        typer.Argument(
            help="A scene's name or .toml, or the whole name of a simulated camera: "
            "mirrors, my.toml, 'sim:corner?device=prototype&ambient=on'."
        ),
    ] = "",
    all_scenes: Annotated[
        bool, typer.Option("--all-scenes", help="All built-in scenes, as a table in Markdown.")
    ] = False,
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
    """Say which effects a scene calls for, why, how large each is, its cost, and what it lacks."""
    options = {
        "base_frequency_hz": base_frequency_hz,
        "harmonics": harmonics,
        "zeroth": zeroth,
        "exposure_s": exposure_s,
        "takes": takes,
    }
    if bool(scene) == all_scenes:
        echo("transientcam explain: name a scene, or give --all-scenes", err=True)
        raise typer.Exit(_BAD_USAGE)
    names = (
        [info.name for info in list_scenes() if info.name != MEASURED] if all_scenes else [scene]
    )
    try:
        wanted = _sequence(sequence, options)
        explanations = [_explained(name, wanted) for name in names]
    except DriverError as error:
        echo(f"transientcam explain: {error}", err=True)
        raise typer.Exit(_BAD_USAGE) from error
    if as_json:
        documents = [each.to_document() for each in explanations]
        echo(json.dumps(documents if all_scenes else documents[0], indent=2))
    elif all_scenes:
        echo(scenes_table(explanations))
    else:
        echo(described(explanations[0]))


def _sequence(path: Path | None, options: dict[str, Any]) -> Sequence:
    sequence = Sequence() if path is None else Sequence.from_document(_document(path))
    return replace(
        sequence, **{name: value for name, value in options.items() if value is not None}
    )


def _document(path: Path) -> Any:
    try:
        return json.loads(read_text(path))
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


def described(explanation: Explanation) -> str:
    """Return an explanation as text of 80 columns, in three lists.

    What is called for, what is not, and what is called for and cannot be made.
    """
    sequence = explanation.sequence
    head = (
        f"{explanation.scene}, {explanation.device} device: m = {sequence.harmonics} at "
        f"{sequence.base_frequency_hz / 1e6:g} MHz, {sequence.exposure_s * 1e3:g} ms, "
        f"{sequence.images} images. The noise of a moment is {explanation.floor_dn:.1f} DN. "
        f"An effect is called for above {explanation.threshold:g} of the noise over all lit "
        f"pixels, or above {explanation.threshold_of_worst:g} of it in any pixel."
    )
    lines = textwrap.wrap(head, _COLUMNS)
    always = [each for each in explanation.effects if each.built and each.effect in _ALWAYS]
    there = [each for each in explanation.effects if each.built or each.size_dn]
    there = [each for each in [*there, *explanation.not_made] if each not in always]
    called = [each for each in there if each.called_for]
    parts = (
        ("Called for:", [each for each in called if each.choice != "never"]),
        ("Not called for:", [each for each in there if not each.called_for]),
        ("Called for, and cannot be made:", [each for each in called if each.choice == "never"]),
    )
    for title, effects in parts:
        lines += ["", title] if effects else []
        for each in effects:
            lines += _lines(each)
    absent = [each.effect for each in explanation.effects if not each.built and not each.size_dn]
    sizes = (f"{each.effect} ({_figure(each.relative)} x the noise)" for each in always)
    for title, names in (("Always there", sizes), ("Not there", absent)):
        lines += ["", *textwrap.wrap(f"{title}: {', '.join(names)}.", _COLUMNS)]
    return "\n".join(lines)


def _lines(each: ExplainedEffect) -> list[str]:
    """Say what an effect is, how large, at what cost, by whose choice, and why."""
    size = f"{_figure(each.relative)} x the noise, at most {_figure(each.worst)} x"
    cost = f"; {_figure(each.cost_s * 1e3)} ms a frame" if each.cost_s else "; no time a frame"
    choice = f"; switched {each.choice}" if each.choice in ("on", "off") else ""
    return [
        *textwrap.wrap(f"  {each.effect}: {each.what}", _COLUMNS, subsequent_indent="      "),
        f"      {size}{cost if each.choice != 'never' else ''}{choice}",
        *textwrap.wrap(each.reason, _COLUMNS, initial_indent="      ", subsequent_indent="      "),
    ]


def scenes_table(explanations: list[Explanation]) -> str:
    """Return the sizes of effects over the noise by scene: root mean square, and largest."""
    names = [each.effect for each in explanations[0].effects]
    there = [
        name
        for k, name in enumerate(names)
        if any(explanation.effects[k].size_dn for explanation in explanations)
    ]
    rows = [
        f"| scene | {' | '.join([*there, 'cannot be made'])} |",
        "|---" * (2 + len(there)) + "|",
    ]
    for explanation in explanations:
        cells = [_cell(each) for each in explanation.effects if each.effect in there]
        lacks = (each for each in explanation.not_made if each.called_for)
        cells.append(", ".join(f"{each.effect} {_cell(each)}" for each in lacks))
        rows.append(f"| {explanation.scene} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def _cell(each: ExplainedEffect) -> str:
    if not each.size_dn:
        return ""
    size = f"{_figure(each.relative)} ({_figure(each.worst)})"
    return f"**{size}**" if each.built else size


def _figure(value: float) -> str:
    """Two digits, and no powers of ten for what is large."""
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"
