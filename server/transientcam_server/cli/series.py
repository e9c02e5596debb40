"""The verb ``series`` of the ``transientcam`` command."""

import csv
import json
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import echo

_List = Annotated[str | None, typer.Option(metavar="A,B,...", help="[default: as it is]")]
_UNIT: Final = {"exposure_s": 1e-6, "base_frequency_hz": 1e6}


def series(
    url: Annotated[str, typer.Argument(metavar="URL", help="The daemon whose camera captures.")],
    m: _List = None,
    exposure_us: _List = None,
    base_frequency_mhz: _List = None,
    takes: _List = None,
    estimator: _List = None,
    neighbours: _List = None,
    frames: Annotated[int, typer.Option(min=2, help="At each setting.")] = 100,
    target_m: Annotated[float | None, typer.Option(help="Count ranges that are so close.")] = None,
    region: Annotated[
        str | None, typer.Option(metavar="X,Y,WIDTH,HEIGHT", help="[default: all pixels]")
    ] = None,
    file: Annotated[Path | None, typer.Option("--csv", help="Write the table there.")] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Capture frames at every combination of settings, and compare how far their ranges are off.

    The sequence in use returns at the end, also after Ctrl-C, which ends the series.
    """
    from transientcam import Camera
    from transientcam_server.cli.progress import followed

    columns = [
        _numbers("--m", m, "harmonics"),
        _numbers("--exposure-us", exposure_us, "exposure_s"),
        _numbers("--base-frequency-mhz", base_frequency_mhz, "base_frequency_hz"),
        _numbers("--takes", takes, "takes"),
        [{"estimator": each} for each in estimator.split(",")] if estimator else [{}],
        [{"neighbours": each} for each in neighbours.split(",")] if neighbours else [{}],
    ]
    settings = [
        {"sequence": f | e | b | t, "reconstruction": of | averaged}
        for f, e, b, t, of, averaged in product(*columns)
    ]
    box = [each[""] for each in _numbers("--region", region, "")] if region else None
    with Camera(url, token=token) as camera:
        start = partial(camera.start_series, settings, frames, target_m=target_m, region=box)
        job = followed(camera, start)
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
        given = {name: each for name, each in row.items() if each is not None}
        shown = [f"{each:.4g}" if isinstance(each, float) else each for each in given.values()]
        echo(", ".join(map("{} {}".format, given, shown)))
    echo(f"in the page: {camera.url}/#view=series&series={job['id']}", err=True)


def _numbers(option: str, text: str | None, field: str) -> list[dict[str, Any]]:
    """Return what each number of a list sets; nothing once without a list."""
    if text is None:
        return [{}]
    scale, read = _UNIT.get(field, 1), float if field in _UNIT else int
    try:
        return [{field: scale * read(each)} for each in text.split(",")]
    except ValueError as error:
        raise typer.BadParameter(f"{text!r}: must be numbers, as 3,4", param_hint=option) from error
