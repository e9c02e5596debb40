"""The verb ``stability`` of the ``transientcam`` command: what averaging over time is worth."""

import itertools
import json
from collections.abc import Iterator
from typing import Annotated, Any

import typer
from numpy.typing import NDArray

from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import echo
from transientcam_server.cli.reconstruct_recordings import ReconstructionChoices


def stability(
    place: Annotated[
        str,
        typer.Argument(
            metavar="PLACE",
            help="A daemon with its running camera (http://HOST:8000), or a recording: a file, or "
            "its address (http://HOST:8000/api/v1/recordings/ID).",
        ),
    ],
    frames: Annotated[int, typer.Option(min=16, max=4096, help="How many, at most.")] = 256,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the best averaging time: the least of the Allan deviation of the range."""
    from transientcam_server.offline import stability as of_frames

    live = "://" in place and "/recordings/" not in place
    found = of_frames((_seen if live else _recorded)(place, frames, token))
    lines = ["    s  median  p90  noise alone, mm"]
    columns = (found[name] for name in ("averaging_s", "median_m", "p90_m", "noise_alone_m"))
    for each_s, *rest in zip(*columns, strict=True):
        lines.append(f"{each_s:7.3g} " + " ".join(f"{1e3 * each:7.3g}" for each in rest))
    more = "; longer may be better still" if found["longer_may_help"] else ""
    best = f"{found['best_averaging_s']:.3g} s ({found['best_frames']} frames){more}"
    lines.append(f"The best averaging time is {best}.")
    echo(json.dumps(found) if as_json else "\n".join(lines))


def _seen(url: str, most: int, token: str | None) -> Iterator[tuple[float, NDArray[Any]]]:
    from transientcam import Camera

    with Camera(url, token=token) as camera, camera.stream("range") as stream:
        for frame in itertools.islice(stream, most):
            yield frame.meta["device_time_s"], frame.array


def _recorded(place: str, most: int, token: str | None) -> Iterator[tuple[float, NDArray[Any]]]:
    from transientcam_server.offline import BatchReconstructor, recording_at

    with recording_at(place, token=token) as opened:
        options = ReconstructionChoices(("range",), {}, bins=1).options(opened.header)
        reconstructor = BatchReconstructor(opened, options)
        for index in range(min(most, opened.frames)):
            raw = opened.frame(index)
            yield raw.device_time_s, reconstructor.compute(raw)["range"]
