"""``transientcam capture``: one product of the newest frame, into a file."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from transientcam.camera import Camera
from transientcam.cli.formats import Format, frame_bytes
from transientcam.cli.options import JsonOption, ProductArgument, TokenOption, UrlArgument
from transientcam.frame import Frame


def capture(
    url: UrlArgument,
    product: ProductArgument,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="File to write; - is standard output."),
    ],
    time_s: Annotated[
        list[float] | None,
        typer.Option(help="Time of flight in seconds; give it once for each. For transients."),
    ] = None,
    bins: Annotated[
        int | None, typer.Option(help="How many times of flight instead, evenly spaced.")
    ] = None,
    form: Annotated[
        Format | None, typer.Option("--format", help="Format; without it, by the file's suffix.")
    ] = None,
    colour: Annotated[bool, typer.Option(help="PNG in colours for the eye.")] = False,
    wait_s: Annotated[float, typer.Option(help="How long to wait for a first frame.")] = 10.0,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Save one product of the newest frame in a file."""
    form = form or _format_of(output)
    with Camera(url, token=token) as camera:
        if form is Format.PNG:
            data = camera.picture(product, colour=colour, wait_s=wait_s)
            report: dict[str, object] = {"product": product}
        else:
            frame = camera.frame(product, time_s=time_s, bins=bins, wait_s=wait_s)
            data = frame_bytes(frame, form)
            report = _report(frame)
    if str(output) == "-":
        sys.stdout.buffer.write(data)
        return
    output.write_bytes(data)
    report |= {"file": str(output), "bytes": len(data)}
    typer.echo(json.dumps(report) if as_json else f"{product}: {len(data)} bytes in {output}")


def _format_of(output: Path) -> Format:
    try:
        return Format(output.suffix.removeprefix(".").lower())
    except ValueError:
        known = ", ".join(Format)
        raise typer.BadParameter(
            f"{output} has no suffix that is a format; give --format, one of {known}.",
            param_hint="--output",
        ) from None


def _report(frame: Frame) -> dict[str, object]:
    return {
        "product": frame.product,
        "unit": frame.unit,
        "axes": list(frame.axes),
        "shape": list(frame.array.shape),
        "dtype": frame.array.dtype.str,
        "meta": dict(frame.meta),
    }
