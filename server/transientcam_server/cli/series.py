"""The verb ``series`` of the ``transientcam`` command."""

import csv
import json
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import typer

from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import echo


def series(
    url: Annotated[str, typer.Argument(metavar="URL", help="The daemon whose camera captures.")],
    m: Annotated[str | None, typer.Option(help="Harmonics, as in 3,4.")] = None,
    exposure_us: Annotated[str | None, typer.Option(help="Exposures of an image.")] = None,
    base_frequency_mhz: Annotated[str | None, typer.Option(help="Base frequencies.")] = None,
    takes: Annotated[str | None, typer.Option(help="Takes of each image.")] = None,
    estimator: Annotated[str | None, typer.Option(help="Estimators of the range.")] = None,
    neighbours: Annotated[
        str | None, typer.Option(help="gaussian, edge-preserving or none.")
    ] = None,
    frames: Annotated[int, typer.Option(min=2, max=10_000, help="At each setting.")] = 100,
    target_m: Annotated[
        float | None, typer.Option(min=0.0, help="Also count the ranges that are so close.")
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(metavar="X,Y,WIDTH,HEIGHT", help="The pixels that count.  [default: all]"),
    ] = None,
    file: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write the table there.")
    ] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture frames at every combination of settings, and compare how far their ranges are off.

    Lists are separated by commas; what is not given stays as it is. The sequence in use returns at
    the end, also after Ctrl-C, which ends the series.
    """
    from transientcam import Camera
    from transientcam_server.cli.progress import followed

    columns = [
        _column("--m", m, "sequence", "harmonics", int),
        _column("--exposure-us", exposure_us, "sequence", "exposure_s", _micro),
        _column("--base-frequency-mhz", base_frequency_mhz, "sequence", "base_frequency_hz", _mega),
        _column("--takes", takes, "sequence", "takes", int),
        _column("--estimator", estimator, "reconstruction", "estimator", str),
        _column("--neighbours", neighbours, "reconstruction", "neighbours", str),
    ]
    settings = []
    for row in product(*filter(None, columns)):
        setting: dict[str, dict[str, Any]] = {"sequence": {}, "reconstruction": {}}
        for group, field, value in row:
            setting[group][field] = value
        settings.append(setting)
    corners = (
        None if region is None else [x for _, _, x in _column("--region", region, "", "", int)]
    )
    with Camera(url, token=token) as camera:
        start = partial(camera.start_series, settings, frames, target_m=target_m, region=corners)
        job = followed(camera, start)
        shown = f"{camera.url}/?series={job['id']} shows it in the page"
    rows = job["result"]["rows"]
    if file is not None:
        with file.open("w", newline="", encoding="utf-8") as out:
            table = csv.DictWriter(out, rows[0])
            table.writeheader()
            table.writerows(rows)
    if as_json:
        echo(json.dumps(job["result"] | {"job": job["id"]}))
        return
    for row in rows:
        echo(
            ", ".join(f"{name} {_short(value)}" for name, value in row.items() if value is not None)
        )
    echo(shown, err=True)


def _column(
    option: str, text: str | None, group: str, field: str, read: Callable[[str], Any]
) -> list[tuple[str, str, Any]]:
    """Return what the words of an option set, each as group, field and value."""
    try:
        return [(group, field, read(each.strip())) for each in (text or "").split(",") if each]
    except ValueError as error:
        raise typer.BadParameter(f"{text!r} is no list of numbers", param_hint=option) from error


def _micro(text: str) -> float:
    return float(text) * 1e-6


def _mega(text: str) -> float:
    return float(text) * 1e6


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
