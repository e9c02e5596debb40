"""``transientcam capture``: one product of a frame, into a file."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from transientcam.camera import Camera
from transientcam.cli.formats import MADE_BY_DAEMON, Format, frame_bytes
from transientcam.cli.options import JsonOption, ProductArgument, TokenOption, UrlArgument
from transientcam.cli.terminal import echo
from transientcam.frame import Frame


def capture(
    url: UrlArgument,
    product: ProductArgument,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="File to write; - is standard output.")
    ],
    number: Annotated[
        int | None, typer.Option(min=1, help="Number of the frame; default: the newest.")
    ] = None,
    recording: Annotated[
        str | None, typer.Option(help="Id of the recording to read instead of the live camera.")
    ] = None,
    region: Annotated[
        str | None, typer.Option(help="Only this part: x,y,width,height in pixels.")
    ] = None,
    decimation: Annotated[
        int | None, typer.Option(min=1, help="Only every so many pixels, both ways.")
    ] = None,
    time_s: Annotated[
        list[float] | None,
        typer.Option(help="Time of flight in seconds; give it once for each. For transients."),
    ] = None,
    bins: Annotated[
        int | None, typer.Option(help="How many times of flight instead, evenly spaced.")
    ] = None,
    y: Annotated[int | None, typer.Option(help="Row of a streak.")] = None,
    form: Annotated[
        Format | None, typer.Option("--format", help="Format; without it, by the file's suffix.")
    ] = None,
    colour: Annotated[bool, typer.Option(help="PNG in false colours.")] = False,
    wait_s: Annotated[
        float, typer.Option(help="How long to wait for a frame that is still to come.")
    ] = 10.0,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Save one product of a frame in a file."""
    form = form or _format_of(output)
    options: dict[str, Any] = {
        "number": number,
        "recording": recording,
        "region": _region_of(region),
        "decimation": decimation,
        "time_s": time_s,
        "bins": bins,
        "y": y,
        # a recording has all its frames
        "wait_s": wait_s if recording is None else None,
    }
    with Camera(url, token=token) as camera:
        # of raw images the daemon alone has the gains that belong into the file
        if form in MADE_BY_DAEMON or (form is Format.NPZ and product == "raw"):
            data = camera.file(product, form.value, colour=colour, **options)
            report: dict[str, object] = {"product": product}
        else:
            frame = camera.frame(product, **options)
            data = frame_bytes(frame, form)
            report = _report(frame)
    if str(output) == "-":
        sys.stdout.buffer.write(data)
        return
    output.write_bytes(data)
    report |= {"file": str(output), "bytes": len(data)}
    echo(json.dumps(report) if as_json else f"{product}: {len(data)} bytes in {output}")


def _format_of(output: Path) -> Format:
    suffix = output.suffix.removeprefix(".").lower()
    try:
        return Format("tiff" if suffix == "tif" else suffix)
    except ValueError:
        known = ", ".join(Format)
        raise typer.BadParameter(
            f"{output} has no suffix that is a format; give --format, one of {known}.",
            param_hint="--output",
        ) from None


def _region_of(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is not x,y,width,height in whole pixels.", param_hint="--region"
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
