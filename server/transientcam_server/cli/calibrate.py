"""The verb ``calibrate`` of the ``transientcam`` command.

What is heavy is imported when the verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from transientcam.cli.options import TokenOption, require_suffix
from transientcam.cli.terminal import echo, progress_bars
from transientcam_driver.texts import in_celsius, read_text

if TYPE_CHECKING:
    from transientcam_driver import Camera
    from transientcam_server.imaging import Calibration


def calibrate(
    url: Annotated[
        str | None,
        typer.Argument(metavar="[URL]", help="Daemon whose camera is calibrated."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The .npz to write; a daemon also keeps a copy."),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(help="Without a daemon: usb[:SERIAL] or sim:SCENE  [default: usb]"),
    ] = None,
    takes: Annotated[int, typer.Option(min=2, max=10_000, help="Captures of each image.")] = 40,
    sequence: Annotated[
        str | None,
        typer.Option(
            help="Without a daemon: what to calibrate for, a sequence as JSON, as in "
            "'{\"harmonics\": 4}', or a file of it.  [default: what the daemon starts with]"
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the calibration in the daemon.")] = "",
    activate: Annotated[
        bool, typer.Option("--activate", help="Use it in the daemon at once.")
    ] = False,
    force: Annotated[
        bool,
        typer.Option("--force", help="Use it even if it was not measured on a diffuser."),
    ] = False,
    diffuser: Annotated[
        bool,
        typer.Option(
            "--diffuser",
            "--diffusor",
            help="Put the diffuser before a simulated lens while measuring.",
        ),
    ] = False,
    harmonics: Annotated[
        bool,
        typer.Option(help="Measure the harmonics of the modulation, by a phase sweep."),
    ] = True,
    undo: Annotated[
        bool,
        typer.Option(
            "--undo", help="Measure nothing; the daemon returns to the previous calibration."
        ),
    ] = False,
    token: TokenOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure each pixel's gain and phase, while the light shines at the sensor (Sec. 4.2).

    Put filter and diffuser before the lens first. A daemon measures with its present sequence and
    stores the result; without one, the file is meant for `serve --calibration FILE`. What does not
    look like a diffuser is kept, but not used, and the exit code is 1; --force uses it anyway.
    """
    require_suffix(output, ".npz")
    if undo:
        _undo(url, token, as_json=as_json)
        return
    if output is not None and not output.parent.is_dir():  # checked before anything is captured
        raise typer.BadParameter(f"there is no folder {output.parent}", param_hint="--output")
    if url is None:
        _refuse({"--name": name, "--activate": activate}, "needs the URL of a daemon")
        if diffuser and not (camera or "usb").startswith("sim:"):
            raise typer.BadParameter("is for simulated cameras", param_hint="--diffuser")
        if output is None:
            raise typer.BadParameter("names the file to write", param_hint="--output")
        order = _Order(
            camera or "usb",
            takes,
            sequence,
            output,
            force=force,
            diffuser=diffuser,
            harmonics=harmonics,
        )
        result = _measured_here(order)
    else:
        _refuse({"--camera": camera, "--sequence": sequence}, "is the daemon's, if there is one")
        options = {"name": name, "frames": takes, "activate": activate, "force": force}
        options["harmonics"] = harmonics
        result = _measured_by_daemon(url, options, output, token, diffuser=diffuser)
    if as_json:
        echo(json.dumps(result, indent=2))
    elif url is None:
        _print_capture(result)
    else:
        _print_measured(result)
    verdict = result["verdict"] if url is None else result["measured"]["verdict"]
    if verdict["reason"] is not None and not force:
        raise typer.Exit(code=1)


@dataclass(frozen=True, slots=True)
class _Order:
    """What to measure without a daemon."""

    camera: str
    takes: int
    sequence: str | None
    output: Path
    force: bool
    diffuser: bool
    harmonics: bool


def _undo(url: str | None, token: str | None, *, as_json: bool) -> None:
    from transientcam import Camera

    if url is None:
        raise typer.BadParameter("needs the URL of a daemon", param_hint="--undo")
    with Camera(url, token=token) as camera:
        active = camera.calibrations.undo()
    used, former = active["id"], active["former"]
    echo(json.dumps(active, indent=2) if as_json else f"{used} is in use again, not {former}")


def _refuse(options: dict[str, Any], reason: str) -> None:
    for hint, value in options.items():
        if value:
            raise typer.BadParameter(reason, param_hint=hint)


def _measured_by_daemon(
    url: str, options: dict[str, Any], output: Path | None, token: str | None, *, diffuser: bool
) -> dict[str, Any]:
    """Measure in a daemon and return its result; Ctrl-C cancels the job there, too."""
    from transientcam import Camera

    with Camera(url, token=token) as camera, progress_bars() as shown:
        task = shown.add_task("waiting", total=1.0)

        def show(job: Mapping[str, Any]) -> None:
            shown.update(task, description=job["step"], completed=job["progress"])

        with _before_lens(camera.simulate) if diffuser else nullcontext():
            job = camera.calibrations.measure(**options)
            try:
                job = camera.wait_for(job["id"], on_progress=show)
            except KeyboardInterrupt:
                camera.jobs.cancel(job["id"])
                raise
        show(job)
        if job["state"] == "cancelled":
            raise typer.Exit(code=1)
        identity = job["result"]["calibration"]
        if output is not None:
            output.write_bytes(camera.calibrations.export(identity))
        return {
            "calibration": camera.calibrations.get(identity),
            "measured": job["result"],
            "file": None if output is None else str(output),
        }


@contextmanager
def _before_lens(change: Callable[..., object]) -> Iterator[None]:
    """Put the diffuser before the lens of a simulated camera inside."""
    change(diffuser=True)
    try:
        yield
    finally:
        change(diffuser=False)


def _measured_here(order: _Order) -> dict[str, Any]:
    from transientcam_driver import Sequence, open_camera
    from transientcam_server.camera import start_with
    from transientcam_server.imaging import SWEEP_ON_A_SCENE, judge, to_document
    from transientcam_server.settings import SequenceSettings

    requested = None
    if order.sequence is not None:
        requested = Sequence.from_document(_document(order.sequence))
    with open_camera(order.camera) as opened:
        if requested is None:
            start_with(opened, SequenceSettings())
        else:
            opened.configure(requested)
        simulation = opened.simulation if order.diffuser else None
        with nullcontext() if simulation is None else _before_lens(simulation.change):
            measured, why_not = _measure(opened, order)
        full_scale = 2.0**opened.capabilities.bits - 1.0
    verdict = judge(measured.capture, measured.gains.bad, full_scale=full_scale).to_document()
    notes = {"verdict": verdict, "forced": order.force}
    capture = replace(measured.capture, notes=notes)
    if verdict["verdict"] == "scene" and capture.waveform is not None:
        capture, why_not = replace(capture, waveform=None), SWEEP_ON_A_SCENE
    capture.save(order.output)
    return _result(replace(measured, capture=capture), order.output) | {
        "verdict": verdict,
        "forced": order.force,
        "harmonics": to_document(capture.waveform),
        "no_harmonics": why_not,
    }


def _measure(camera: "Camera", order: _Order) -> "tuple[Calibration, str | None]":
    """Measure with a camera; also return why there are no harmonics."""
    import transientcam_moments as tm
    from transientcam_driver import capture_calibration
    from transientcam_server.imaging import SweepEvaluation, evaluate

    sweep = SweepEvaluation(camera.capabilities, takes=order.takes)
    with progress_bars() as shown:
        task = shown.add_task("capturing", total=None)
        capture = capture_calibration(
            camera,
            takes=order.takes,
            average=tm.average_takes,
            waveform=sweep if order.harmonics else None,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )
        shown.update(task, description="evaluating")
        return evaluate(capture), sweep.reason if order.harmonics else None


def _document(text: str) -> dict[str, Any]:
    try:
        source = text if text.lstrip().startswith("{") else read_text(Path(text))
        document = json.loads(source)
    except ValueError as error:
        raise typer.BadParameter(f"is no JSON: {error}", param_hint="--sequence") from error
    if not isinstance(document, dict):
        raise typer.BadParameter("is no JSON object", param_hint="--sequence")
    return document


def _result(measured: "Calibration", output: Path) -> dict[str, Any]:
    capture = measured.capture
    images, height, width = capture.images.shape
    return {
        "file": str(output),
        "calibration_id": capture.id,
        "serial": capture.serial,
        "width": width,
        "height": height,
        "temperature_c": capture.temperature_c,
        "images": images,
        "takes": len(capture.kept),
        "rejected_images": capture.rejected_images,
        "bad_pixels": measured.gains.bad_pixels,
        "sequence": capture.sequence.to_document(),
    }


def _print_capture(result: dict[str, Any]) -> None:
    captured = result["images"] * result["takes"]
    lines = (
        f"{result['file']}: {result['calibration_id']}",
        f"  {result['width']} x {result['height']} pixels of {result['serial']} "
        f"at {in_celsius(result['temperature_c'])}, {result['bad_pixels']} of them bad",
        f"  {result['rejected_images']} of {captured} images left out as outliers",
        *_harmonics_lines(result),
        *_verdict_lines(result["verdict"]),
    )
    for line in lines:
        echo(line)


def _harmonics_lines(result: Mapping[str, Any]) -> list[str]:
    """Say which harmonics of the modulation are known, or why none are."""
    if (found := result.get("harmonics")) is not None:
        share = found["largest_share"]
        return [f"  harmonics of the modulation up to {share:.2%} of the fundamental; taken out"]
    reason = result.get("no_harmonics")
    return [] if reason is None else [f"  harmonics of the modulation are not known: {reason}"]


def _verdict_lines(verdict: Mapping[str, Any]) -> list[str]:
    """Say whether it was measured on a diffuser, and if not, why, where, and what can be done."""
    if verdict["reason"] is None:
        return ["  measured on a diffuser"]
    what = {"scene": "this is a scene, not a diffuser", "in-doubt": "this may be no diffuser"}
    lines = [f"  {what[verdict['verdict']]}: {verdict['reason']}"]
    if any("#" in row for row in verdict["blocks"]):
        lines.append(f"  unlike a diffuser (#), in blocks of {verdict['block_px']} pixels:")
        lines += [f"    {row}" for row in verdict["blocks"]]
    return [*lines, "  it is used only if it is forced (--force)"]


def _print_measured(result: dict[str, Any]) -> None:
    calibration, measured = result["calibration"], result["measured"]
    device, name = calibration["device"], calibration["name"]
    lines = [
        calibration["id"] + (f" ({name})" if name else ""),
        f"  {device['width']} x {device['height']} pixels of {device['serial']} "
        f"at {in_celsius(calibration['temperature_c'])}, {measured['bad_pixels']} of them bad",
        f"  {measured['rejected_images']} of {measured['images']} images left out as outliers",
    ]
    lines += _harmonics_lines(measured)
    lines += _verdict_lines(measured["verdict"])
    if calibration["active"]:
        lines.append("  in use")
        if measured["former"] is not None:
            lines.append(f"  before it {measured['former']} was; --undo returns to it")
    if result["file"] is not None:
        lines.append(f"  downloaded into {result['file']}")
    for line in lines:
        echo(line)
