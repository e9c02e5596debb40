"""The verb ``calibrate`` of the ``transientcam`` command."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from transientcam.cli.options import TokenOption, require_suffix
from transientcam.cli.terminal import Terminal, echo, progress_bars
from transientcam_driver.texts import in_celsius, read_text

if TYPE_CHECKING:
    from transientcam import Camera as Client
    from transientcam_driver import Camera
    from transientcam_server.imaging import Calibration


def calibrate(
    url: Annotated[
        str | None, typer.Argument(metavar="[URL]", help="Daemon whose camera is calibrated.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="The .npz to write; a daemon also keeps a copy. With --noise settings as .toml.",
        ),
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="Without a daemon: usb[:SERIAL] or sim:SCENE  [default: usb]")
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
        bool, typer.Option("--force", help="Use it even if it was not measured on a diffuser.")
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
        bool, typer.Option(help="Measure the harmonics of the modulation, by a phase sweep.")
    ] = True,
    undo: Annotated[
        bool,
        typer.Option(
            "--undo", help="Measure nothing; the daemon returns to the previous calibration."
        ),
    ] = False,
    noise: Annotated[
        bool,
        typer.Option(
            "--noise",
            help="Without a daemon: measure the noise of the sensor before a still scene.",
        ),
    ] = False,
    lens: Annotated[
        bool,
        typer.Option(
            "--lens",
            help="Measure the lens instead, by a flat wall from several sides, or a printed "
            "--board: prints [lens] of the settings.",
        ),
    ] = False,
    beam: Annotated[
        bool,
        typer.Option(
            "--beam",
            help="Measure the beam of the light instead, by a white wall: prints [lens] of the "
            "settings. Ranges that are too bright for it are then not trusted.",
        ),
    ] = False,
    board: Annotated[
        str | None,
        typer.Option(
            metavar="CxR",
            help="A chessboard of so many inner corners across and down, as 9x6, or charuco:7x5, "
            "of so many squares. Needs OpenCV.",
        ),
    ] = None,
    views: Annotated[int, typer.Option(min=2, max=100, help="From how many sides.")] = 5,
    second: Annotated[
        str | None,
        typer.Option(metavar="URL", help="Daemon of a camera that sees the same walls: its pose."),
    ] = None,
    token: TokenOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure each pixel's gain and phase, while the light shines at the sensor (Sec. 4.2).

    Put filter and diffuser before the lens first. A daemon measures with its present sequence and
    stores the result; without one, the file is meant for `serve --calibration FILE`. What does not
    look like a diffuser is kept, but not used, and the exit code is 1; --force uses it anyway.
    With --noise it is the noise of the sensor, before a still scene with dark and bright parts.
    """
    if noise:
        _refuse({"URL": url}, "--noise needs the camera itself: end the daemon first")
        _measure_noise(camera or "usb", takes, output, as_json=as_json)
        return
    require_suffix(output, ".npz")
    if lens or beam:
        kept = {"--name": name, "--output": output, "--activate": activate, "--force": force}
        others = {"--camera": camera, "--sequence": sequence, "--undo": undo}
        hint = "--beam" if beam else "--lens"
        _refuse(kept | others, f"is not for {hint}")
        if url is None:
            raise typer.BadParameter("needs the URL of a daemon", param_hint=hint)
        if beam:
            _refuse({"--board": board, "--second": second, "--lens": lens}, "is not for --beam")
            _measure_beam(url, takes=takes, token=token, as_json=as_json)
            return
        if board is not None:
            _refuse({"--second": second}, "needs walls, not a --board")
        urls = [url, *filter(None, [second])]
        _measure_lens(urls, board, views=views, takes=takes, token=token, as_json=as_json)
        return
    _refuse({"--board": board, "--second": second}, "is for --lens")
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
        result = _measured_here(
            camera or "usb",
            None if sequence is None else _document(sequence),
            output,
            takes=takes,
            force=force,
            diffuser=diffuser,
            sweep=harmonics,
        )
    else:
        _refuse({"--camera": camera, "--sequence": sequence}, "is the daemon's, if there is one")
        options = {"name": name, "frames": takes, "activate": activate, "force": force}
        options["harmonics"] = harmonics
        result = _measured_by_daemon(url, options, output, token, diffuser=diffuser)
    if as_json:
        echo(json.dumps(result, indent=2))
    elif url is None:
        head, count = f"{result['file']}: {result['calibration_id']}", result["takes"]
        echo("\n".join(_lines(head, result, result, result, count * result["images"])))
    else:
        _print_measured(result)
    verdict = result["verdict"] if url is None else result["measured"]["verdict"]
    if verdict["reason"] is not None and not force:
        raise typer.Exit(code=1)


def _measure_lens(
    urls: Sequence[str],
    board_name: str | None,
    *,
    views: int,
    takes: int,
    token: str | None,
    as_json: bool,
) -> None:
    from transientcam import Camera
    from transientcam_server.imaging import Board, Intrinsics, lens_of_walls, second_in_first

    board = None if board_name is None else Board(board_name)
    what, product = ("wall", "range") if board is None else ("board", "brightness")
    with ExitStack() as opened:
        cameras = [opened.enter_context(Camera(url, token=token)) for url in urls]
        known = [Intrinsics.of_document(each.camera["intrinsics"]) for each in cameras]
        seen: list[list[Any]] = [[] for _ in cameras]
        for view in range(views):
            asked = f"the {what} from side {view + 1} of {views}, then Enter"
            typer.prompt(asked, default="", show_default=False, err=True)
            for each, own in zip(cameras, seen, strict=True):
                own.append(_mean(each, product, takes))
            if board is not None and board.corners(seen[0][-1]) is None:
                echo(f"no {board_name} was found: show it whole, nearer, in even light", err=True)
    if board is not None:
        found, beside = board.lens(seen[0], known[0].lens)
    else:
        lenses, off_m, walls = zip(*map(lens_of_walls, seen, known), strict=True)
        found, beside = lenses[0], {"deviation_m": off_m[0], "walls": walls[0].tolist()}
        if len(urls) > 1:
            beside["second_in_first"] = second_in_first(*walls).tolist()
    lens = {f"{name}_px": round(getattr(found, name), 3) for name in ("fx", "fy", "cx", "cy")}
    lens["distortion"] = [round(each, 5) for each in found.distortion]
    lines = [f"{name} = {value}" for name, value in lens.items()]
    lines += [f"# {name} = {value}" for name, value in beside.items()]
    echo(json.dumps({"lens": lens} | beside) if as_json else "\n".join(["[lens]", *lines]))


def _measure_beam(url: str, *, takes: int, token: str | None, as_json: bool) -> None:
    from transientcam import Camera
    from transientcam_server.imaging import Intrinsics, beam_of_wall

    with Camera(url, token=token) as camera:
        known = Intrinsics.of_document(camera.camera["intrinsics"])
        exposure_s = camera.sequence["exposure_s"]
        range_m, light_dn = (_mean(camera, name, takes) for name in ("range", "brightness"))
    beam = [float(f"{each:.5g}") for each in beam_of_wall(range_m, light_dn, exposure_s, known)]
    echo(json.dumps({"lens": {"beam": beam}}) if as_json else f"[lens]\nbeam = {beam}")


def _mean(camera: "Client", product: str, takes: int) -> Any:
    import numpy as np

    begun = camera.latest()["frame"] + 3  # some are under way
    with camera.stream(product) as stream:
        new = (frame.array for frame in iter(stream.receive, None) if frame.frame > begun)
        return np.mean([next(new) for _ in range(takes)], axis=0, dtype=np.float64)


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
    from transientcam_server.cli.progress import followed

    with Camera(url, token=token) as camera:
        with _before_lens(camera.simulate) if diffuser else nullcontext():
            job = followed(camera, lambda: camera.calibrations.measure(**options))
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


def _measured_here(
    name: str,
    sequence: Mapping[str, Any] | None,
    output: Path,
    *,
    takes: int,
    force: bool,
    diffuser: bool,
    sweep: bool,
) -> dict[str, Any]:
    from transientcam_driver import Sequence as Captured, open_camera
    from transientcam_server.camera import start_with
    from transientcam_server.imaging import SWEEP_ON_A_SCENE, judge, to_document
    from transientcam_server.settings import SequenceSettings

    requested = None if sequence is None else Captured.from_document(sequence)
    with open_camera(name) as opened:
        if requested is None:
            start_with(opened, SequenceSettings())
        else:
            opened.configure(requested)
        simulation = opened.simulation if diffuser else None
        with nullcontext() if simulation is None else _before_lens(simulation.change):
            measured, why_not = _measure(opened, takes, sweep=sweep)
        full_scale = 2.0**opened.capabilities.bits - 1.0
    verdict = judge(measured.capture, measured.gains.bad, full_scale=full_scale).to_document()
    notes = {"verdict": verdict, "forced": force}
    capture = replace(measured.capture, notes=notes)
    if verdict["verdict"] == "scene" and capture.waveform is not None:
        capture, why_not = replace(capture, waveform=None), SWEEP_ON_A_SCENE
    capture.save(output)
    return _result(replace(measured, capture=capture), output) | {
        "verdict": verdict,
        "forced": force,
        "harmonics": to_document(capture.waveform),
        "no_harmonics": why_not,
    }


def _measure(camera: "Camera", takes: int, *, sweep: bool) -> "tuple[Calibration, str | None]":
    """Measure with a camera; also return why there are no harmonics."""
    import transientcam_moments as tm
    from transientcam_driver import capture_calibration
    from transientcam_server.imaging import SweepEvaluation, evaluate

    swept = SweepEvaluation(camera.capabilities, takes=takes)
    with progress_bars() as shown:
        task = shown.add_task("capturing", total=None)
        capture = capture_calibration(
            camera,
            takes=takes,
            average=tm.average_takes,
            waveform=swept if sweep else None,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )
        shown.update(task, description="evaluating")
        return evaluate(capture), swept.reason if sweep else None


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


def _lines(
    head: str,
    of: Mapping[str, Any],
    device: Mapping[str, Any],
    found: Mapping[str, Any],
    count: int,
) -> list[str]:
    return [
        head,
        f"  {device['width']} x {device['height']} pixels of {device['serial']} "
        f"at {in_celsius(of['temperature_c'])}, {found['bad_pixels']} of them bad",
        f"  {found['rejected_images']} of {count} images left out as outliers",
        *_harmonics_lines(found),
        *_verdict_lines(found["verdict"]),
    ]


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
    head = calibration["id"] + (f" ({calibration['name']})" if calibration["name"] else "")
    lines = _lines(head, calibration, calibration["device"], measured, measured["images"])
    if calibration["active"]:
        lines.append("  in use")
        if measured["former"] is not None:
            lines.append(f"  before it {measured['former']} was; --undo returns to it")
    if result["file"] is not None:
        lines.append(f"  downloaded into {result['file']}")
    echo("\n".join(lines))


def _measure_noise(spec: str, frames: int, output: Path | None, *, as_json: bool) -> None:
    """Measure by photon transfer; print the figures of EMVA 1288, and settings for `serve`."""
    from transientcam_driver import open_camera
    from transientcam_server.camera import measure_photon_transfer
    from transientcam_server.settings import SensorSettings

    with open_camera(spec) as camera, Terminal(stderr=True).status("capturing"):
        document = measure_photon_transfer(camera, frames=frames).to_document()
    figures = [f"# {name} = {value:.4g}" for name, value in document["emva1288"].items()]
    sensor = [f"{name} = {document['sensor'][name]:.6g}" for name in SensorSettings.model_fields]
    text = json.dumps(document) if as_json else "\n".join([*figures, "[sensor]", *sensor])
    if output is None:
        echo(text)
    else:
        output.write_text(text + "\n")
