"""The verb ``stability`` of the ``transientcam`` command: what averaging over time is worth."""

import json
from typing import Annotated, Any

import typer

from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import echo
from transientcam_server.cli.progress import followed, progress_bar
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
    region: Annotated[
        str | None,
        typer.Option(help="Whose pixels count: X,Y,WIDTH,HEIGHT or corners X,Y/X,Y/X,Y."),
    ] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the best averaging time: the Allan deviation of the range over that time.

    It falls as long as noise rules, and rises where drift or motion does.
    """
    from transientcam_server.planning import Region

    chosen = Region.of(region)
    if "://" in place and "/recordings/" not in place:
        from transientcam import Camera

        with Camera(place, token=token) as camera:
            wanted = None if chosen is None else chosen.to_document()
            job = followed(camera, lambda: camera.start_stability(frames, region=wanted))
            found = job["result"]
    else:
        found = _of_recording(place, frames, chosen, token)
    echo(json.dumps(found) if as_json else "\n".join(_in_words(found)))


def _of_recording(place: str, most: int, region: Any, token: str | None) -> dict[str, Any]:
    from transientcam_server.imaging import PIXELS, stability
    from transientcam_server.offline import BatchReconstructor, recording_at

    ranges, times_s = [], []
    with recording_at(place, token=token) as opened, progress_bar("reconstructing") as advance:
        options = ReconstructionChoices(("range",), {}, bins=1).options(opened.header)
        reconstructor = BatchReconstructor(opened, options)
        count = min(most, opened.frames)
        for index in range(count):
            raw = opened.frame(index)
            range_m = reconstructor.compute(raw)["range"]
            seen = range_m.ravel() if region is None else range_m[region.mask(*range_m.shape)]
            ranges.append(seen[:: -(-seen.size // PIXELS)])
            times_s.append(raw.device_time_s)
            advance(index + 1, count)
    return stability(ranges, times_s)


def _in_words(found: dict[str, Any]) -> list[str]:
    lines = [f"{found['frames']} frames, {found['pixels']} pixels; mm", "    s  median  p90  noise"]
    columns = (found[name] for name in ("averaging_s", "median_m", "p90_m", "noise_alone_m"))
    lines += [
        f"{each_s:7.3g} " + " ".join(f"{1e3 * each:7.3g}" for each in rest)
        for each_s, *rest in zip(*columns, strict=True)
    ]
    more = "; longer may be better still" if found["longer_may_help"] else ""
    best = f"{found['best_averaging_s']:.3g} s ({found['best_frames']} frames){more}"
    return [*lines, f"The best averaging time is {best}."]
