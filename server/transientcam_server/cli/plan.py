"""The verb ``plan`` of the ``transientcam`` command."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from transientcam.cli.options import JsonOption, TokenOption
from transientcam.cli.terminal import Terminal, echo
from transientcam_server.cli.plan_text import print_front, print_plan, print_takes

if TYPE_CHECKING:
    from transientcam_server.planning import Goal, Region


def plan(
    range_error_m: Annotated[
        float | None,
        typer.Option(help="How far the range is off, noise and bias together, at most."),
    ] = None,
    share: Annotated[
        float | None,
        typer.Option(
            help="Of the pixels of a capture, so many are to be within that.  [default: 0.9; with "
            "--front: none, for the median pixel]"
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,WIDTH,HEIGHT",
            help="The pixels that count: a box, or the corners X,Y/X,Y/X,Y of a polygon.  "
            "[default: all with light]",
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map",
            metavar="FILE",
            help="Write the predicted error of each pixel: .npy, in m, or .png, for eyes.",
        ),
    ] = None,
    range_std_m: Annotated[
        float | None, typer.Option(help="Standard deviation of the range, at most.")
    ] = None,
    separation_m: Annotated[
        float | None, typer.Option(help="Distance at which two equal returns are both found.")
    ] = None,
    separation_share: Annotated[
        float, typer.Option(help="Share of captures in which both are found.")
    ] = 0.9,
    bound_width: Annotated[
        float | None,
        typer.Option(help="Width of the bounds on the density over its mean, at most."),
    ] = None,
    capture_s: Annotated[float | None, typer.Option(help="Time of one capture, at most.")] = None,
    frame_rate_hz: Annotated[
        float | None, typer.Option(help="Frames a second back to back, at least.")
    ] = None,
    computing_share: Annotated[
        float | None,
        typer.Option(help="Share of the time that reconstruction may take here, at most."),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option(
            "--fix", help="A field of the sequence that must stay, as in zeroth=on-off; repeatable."
        ),
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="The only estimator to plan with: single-frequency, maximum-entropy, likelihood, "
            "pisarenko, or one of another package.  [default: the first three]"
        ),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            help="The camera, and the scene before it; a few captures are taken.  "
            "[default: sim:mirrors]"
        ),
    ] = None,
    daemon: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Let a daemon plan, for the scene before its camera, which goes on capturing.",
        ),
    ] = None,
    front: Annotated[
        bool, typer.Option("--front", help="Return the whole Pareto front instead of one sequence.")
    ] = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Let a simulated camera take its time, too.")
    ] = False,
    brightness_dn_per_s: Annotated[
        float | None,
        typer.Option(
            help="Zeroth moment of a typical pixel in DN for each second of exposure, in the place "
            "of a capture."
        ),
    ] = None,
    returns: Annotated[
        list[str] | None,
        typer.Option(
            "--return", help="With that: RANGE_M or RANGE_M:WEIGHT; repeatable.  [default: 2]"
        ),
    ] = None,
    ambient_dn_per_s: Annotated[
        float | None,
        typer.Option(
            help="Light that is not the camera's, in DN for each second.  [default: as measured]"
        ),
    ] = None,
    token: TokenOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the sequence and estimator for a target accuracy or a budget of time.

    Where the target is out of reach what limits it is printed, and the exit code is 1; it is 3
    where the frame of a camera that is not simulated does not tell. Ctrl-C ends the work, also that
    of a daemon.
    """
    target = {"range_error_m": range_error_m, "range_std_m": range_std_m}
    target |= {"separation_m": separation_m, "bound_width": bound_width}
    budget = {"capture_s": capture_s, "frame_rate_hz": frame_rate_hz}
    budget |= {"computing_share": computing_share}
    stays = _fields(fixed or [])
    if front:
        goal_of_one = {"--fix": fixed or None, "--map": map_file}
        _refuse(
            goal_of_one | _options(target) | _options(budget),
            "is for one sequence, and --front shows all that no other beats",
        )
    if map_file is not None and map_file.suffix not in (".npy", ".png"):
        raise typer.BadParameter(f"{map_file} ends neither in .npy nor in .png", param_hint="--map")
    of_pixels = _region(region)
    console = Terminal(stderr=True)
    if daemon is not None:
        here: dict[str, Any] = {"camera": camera, "real_time": real_time or None}
        here |= {"return": returns or None}
        here |= {"brightness_dn_per_s": brightness_dn_per_s, "ambient_dn_per_s": ambient_dn_per_s}
        _refuse(_options(here), "is the daemon's")
        wanted: dict[str, Any] = {"share": share, "estimator": estimator}
        wanted["region"] = None if of_pixels is None else of_pixels.to_document()
        if not front:
            target |= {"separation_share": separation_share} if separation_m else {}
            wanted |= {"target": _given(target), "budget": _given(budget), "fixed": stays}
            wanted |= {"map": map_file is not None}
        make = partial(_by_daemon, daemon, token, wanted, map_file)
    else:
        from transientcam_server.cli.plan_here import View, by_camera
        from transientcam_server.planning import SHARE

        view = View(
            camera or "sim:mirrors",
            real_time,
            brightness_dn_per_s,
            [_return(text) for text in returns or ["2"]],
            ambient_dn_per_s,
        )
        asked: dict[str, Any] = {
            **target,
            **budget,
            "separation_share": separation_share,
            "estimator": estimator,
        }
        asked |= {"share": share if front or share is not None else SHARE, "region": of_pixels}
        make = partial(by_camera, view, _goal(asked, stays), console, map_file, front=front)
    document, made = _planned(make, console, as_json=as_json)
    if map_file is not None:
        map_file.write_bytes(made)
    if as_json:
        echo(json.dumps(document))
    elif front:
        print_front(document)
    else:
        print_plan(document, computing=computing_share is not None)


def _by_daemon(
    url: str, token: str | None, wanted: dict[str, Any], map_file: Path | None
) -> tuple[dict[str, Any], bytes]:
    """Let a daemon plan for the scene before its camera, and return the plan and its map."""
    from transientcam import Camera
    from transientcam_server.cli.progress import followed

    with Camera(url, token=token) as camera:
        start = camera.start_plan if "target" in wanted else camera.start_tradeoff
        job = followed(camera, partial(start, **wanted))
        made = b"" if map_file is None else camera.plan_map(job["id"], map_file.suffix[1:])
        return job["result"], made


def _goal(asked: dict[str, Any], fixed: dict[str, Any]) -> "Goal":
    from transientcam_driver import Sequence
    from transientcam_server.errors import Problem
    from transientcam_server.planning import Goal

    try:
        return Goal(**asked, base=Sequence.from_document(fixed), fixed=frozenset(fixed))
    except Problem as problem:
        why = f"{problem.detail} `transientcam compare` measures others"
        raise typer.BadParameter(why, param_hint="--estimator") from problem


def _planned(
    made: Callable[[], tuple[dict[str, Any], bytes]], console: Terminal, *, as_json: bool
) -> tuple[dict[str, Any], bytes]:
    """Plan; where that is refused print what limits, and end with exit code 1."""
    from transientcam.errors import ProblemError
    from transientcam_server.errors import Problem

    try:
        return made()
    except (Problem, ProblemError) as problem:
        document: dict[str, Any] = {"detail": problem.detail}
        document |= problem.extensions if isinstance(problem, Problem) else problem.document
        if as_json:
            echo(json.dumps(document))
        else:
            console.print(problem.detail, style="red")
            print_takes(document.get("takes", []))
        raise typer.Exit(1 if document.get("decided", True) else 3) from problem


def _region(text: str | None) -> "Region | None":
    if text is None:
        return None
    from transientcam_server.errors import Problem
    from transientcam_server.planning import Region

    try:
        return Region.of(text)
    except Problem as problem:
        raise typer.BadParameter(problem.detail, param_hint="--region") from problem


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def _options(values: dict[str, Any]) -> dict[str, Any]:
    """Return what is given by the name of its option."""
    return {f"--{name.replace('_', '-')}": value for name, value in _given(values).items()}


def _refuse(options: dict[str, Any], reason: str) -> None:
    for hint, value in options.items():
        if value is not None:
            raise typer.BadParameter(reason, param_hint=hint)


def _fields(texts: list[str]) -> dict[str, Any]:
    """Read NAME=VALUE; a value is JSON or else a word."""
    document = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise typer.BadParameter(f"{text!r} is not NAME=VALUE", param_hint="--fix")
        try:
            document[name] = json.loads(value)
        except json.JSONDecodeError:
            document[name] = value
    return document


def _return(text: str) -> tuple[float, float]:
    range_m, colon, weight = text.partition(":")
    try:
        parts = float(range_m), float(weight) if colon else 1.0
    except ValueError:
        parts = (0.0, 0.0)
    if not all(0 < part < float("inf") for part in parts):
        raise typer.BadParameter(f"{text!r} is not RANGE_M:WEIGHT", param_hint="--return")
    return parts
