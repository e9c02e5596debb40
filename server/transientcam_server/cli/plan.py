"""The verb ``plan`` of the ``transientcam`` command.

What is heavy is imported when the verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from rich.console import Console
from rich.status import Status

from transientcam.cli.options import JsonOption

if TYPE_CHECKING:
    from transientcam_driver import Camera, Sequence
    from transientcam_server.planning import Planner, SceneStatistics
    from transientcam_server.planning.progress import Report
    from transientcam_server.planning.takes import TakesPrediction

MOVING: Final = 0.02
"""Share of moving pixels from which on it is said."""
LOOK_S: Final = 60.0
"""How long a frame may take of a camera that is not planned for: an emulated one computes it."""


def plan(
    range_error_m: Annotated[
        float | None,
        typer.Option(help="Noise and bias of the range together, of the median pixel, at most."),
    ] = None,
    range_std_m: Annotated[
        float | None, typer.Option(help="Standard deviation of the range, at most.")
    ] = None,
    separation_m: Annotated[
        float | None, typer.Option(help="Distance at which two equal returns are both found.")
    ] = None,
    separation_share: Annotated[
        float, typer.Option(help="In what share of all captures they are.")
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
            help="The only estimator to plan with: single-frequency, maximum-entropy, likelihood "
            "or pisarenko.  [default: all of these]"
        ),
    ] = None,
    camera: Annotated[
        str, typer.Option(help="The camera, and the scene before it; a few captures are taken.")
    ] = "sim:mirrors",
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
    as_json: JsonOption = False,
) -> None:
    """Find the sequence and estimator for a target accuracy or a budget of time.

    Where the target is out of reach what limits it is printed, and the exit code is 1.
    """
    import transientcam_moments as tm
    from transientcam_driver import Sequence, open_camera
    from transientcam_driver.clock import RealClock, VirtualClock
    from transientcam_server.camera.source import sensor_of
    from transientcam_server.errors.exceptions import Problem
    from transientcam_server.planning import Goal, Planner, Progress, uniform_scene
    from transientcam_server.planning.estimation import ESTIMATORS
    from transientcam_server.planning.families import require_plannable
    from transientcam_server.planning.takes import predict_takes
    from transientcam_server.settings import ReconstructionSettings, SensorSettings

    if estimator is not None and estimator not in ESTIMATORS:
        known = ", ".join(ESTIMATORS)
        raise typer.BadParameter(f"{estimator!r} is none of {known}", param_hint="--estimator")
    document = _fields(fixed or [])
    goal = Goal(
        range_error_m=range_error_m,
        range_std_m=range_std_m,
        separation_m=separation_m,
        separation_share=separation_share,
        bound_width=bound_width,
        capture_s=capture_s,
        frame_rate_hz=frame_rate_hz,
        computing_share=computing_share,
        base=Sequence.from_document(document),
        fixed=frozenset(document),
        estimator=estimator,
    )
    console = Console(stderr=True)
    virtual = camera.startswith("sim:") and not real_time
    predicted: list[TakesPrediction] = []
    try:
        goal.require_sensible()
        with open_camera(camera, clock=VirtualClock() if virtual else RealClock()) as opened:
            sensor = sensor_of(opened, SensorSettings())
            try:
                require_plannable(opened.capabilities)
            except Problem:
                with console.status("looking at the scene"):
                    predicted = predict_takes(opened, sensor, read_s=LOOK_S)
                raise
            planner = Planner(opened.capabilities, sensor, ReconstructionSettings())
            if computing_share is not None:
                with console.status("compiling kernels"):
                    tm.kernels.compile()  # the daemon's speed is timed
            if brightness_dn_per_s is None:
                scene = _looked(planner, opened, goal.base, ambient_dn_per_s, console)
            else:
                scene = uniform_scene(
                    brightness_dn_per_s,
                    [_return(text) for text in returns or ["2"]],
                    ambient_dn_per_s=ambient_dn_per_s or 0.0,
                )
        with console.status("predicting") as status:
            made = planner.plan(goal, scene, Progress(_shown(status)))
    except Problem as problem:
        if as_json:
            takes = {"takes": [asdict(each) for each in predicted]} if predicted else {}
            typer.echo(json.dumps({"detail": problem.detail, **problem.extensions, **takes}))
        else:
            console.print(problem.detail, style="red", soft_wrap=True)
            _print_takes(predicted)
        raise typer.Exit(1) from problem
    if as_json:
        typer.echo(json.dumps(made.to_document()))
    else:
        _print_plan(made.to_document(), computing=computing_share is not None)


def _looked(
    planner: "Planner",
    camera: "Camera",
    base: "Sequence",
    ambient_dn_per_s: float | None,
    console: Console,
) -> "SceneStatistics":
    """Look at the scene, and show how far that has come."""
    from transientcam_server.planning import Progress

    with console.status("looking at the scene") as status:
        return planner.look(
            camera,
            base,
            ambient_dn_per_s=ambient_dn_per_s,
            progress=Progress(_shown(status)),
        )


def _shown(status: Status) -> "Report":
    """Return what shows how far a look or a plan has come."""
    return lambda share, step: status.update(f"{share:.0%}: {step}")


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


def _print_takes(predicted: "list[TakesPrediction]") -> None:
    for each in predicted:
        cost = f"{each.capture_s * 1e3:.1f} ms ({each.frame_rate_hz:.1f} Hz)"
        typer.echo(f"takes {each.takes:>2}: {cost}, range to {each.range_std_m * 1e3:.2f} mm")


def _print_plan(document: dict[str, Any], *, computing: bool) -> None:
    predicted = document["predicted"]
    error, std = predicted["range_error_m"], predicted["range_std_m"]
    typer.echo(json.dumps(document["sequence"]))
    typer.echo(f"estimator {document['estimator']}")
    time_ms, rate_hz = document["capture_s"] * 1e3, document["frame_rate_hz"]
    typer.echo(f"captures in {time_ms:.1f} ms ({rate_hz:.1f} Hz back to back)")
    if computing:
        typer.echo(
            f"reconstructs in {document['reconstruct_s'] * 1e3:.1f} ms, "
            f"{document['computing_share']:.1%} of the time"
        )
    typer.echo(
        f"range to {error['median'] * 1e3:.2f} mm ({error['low'] * 1e3:.2f} to "
        f"{error['high'] * 1e3:.2f}): noise {std['median'] * 1e3:.2f} mm, "
        f"bias {predicted['range_bias_m'] * 1e3:.2f} mm; "
        f"{predicted['outlier_share']:.1%} of the ranges are outliers"
    )
    typer.echo(document["summary"])
    scene = document["scene"]
    typer.echo(
        f"seen: {scene['lit_share']:.0%} of the pixels lit, at {scene['range_m']:.2f} m; "
        f"{scene['ambient_dn_per_s']:.3g} DN/s of ambient light"
    )
    if scene["moving_share"] > MOVING:
        typer.echo(f"{scene['moving_share']:.0%} of them move: what that costs is not predicted")
    if not scene["ambiguity_checked"]:
        typer.echo("whether ranges are short by a period was not checked")
    if document["predicted"]["beyond_scene"]:
        typer.echo("at best: this resolves more of the scene than the capture it is predicted from")
    if document["predicted"]["separation_share"] is not None:
        share = document["predicted"]["separation_share"]
        typer.echo(f"finds both returns in {share:.0%} of captures")
    if document["predicted"]["bound_width"] is not None:
        width = document["predicted"]["bound_width"]
        typer.echo(f"bounds {width:.3g} times the mean density apart")
    for name, what in (("half_time", "half the time"), ("twice_accuracy", "twice the accuracy")):
        other = document[name]
        if other is None:
            typer.echo(f"{what}: no sequence does")
            continue
        errors = (
            "" if other["error_factor"] is None else f"{other['error_factor']:.2g} x the error, "
        )
        sequence = json.dumps(other["sequence"])
        typer.echo(f"{what}: {errors}{other['time_factor']:.2g} x the time: {sequence}")
