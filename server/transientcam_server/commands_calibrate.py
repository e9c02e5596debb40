"""The verb ``calibrate`` of the ``transientcam`` command.

What is heavy is imported when the verb runs, so that ``transientcam --help`` stays quick.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

if TYPE_CHECKING:
    from transientcam_driver import Camera
    from transientcam_server.calibration import Calibration


def calibrate(
    output: Annotated[Path, typer.Option("--output", "-o", help="The .npz to write.")],
    camera: Annotated[str, typer.Option(help="usb[:SERIAL] or sim:SCENE")] = "usb",
    takes: Annotated[
        int, typer.Option(min=2, max=10_000, help="How often each image is captured.")
    ] = 40,
    sequence: Annotated[
        str | None,
        typer.Option(
            help="What to calibrate for: a sequence as JSON, as in '{\"harmonics\": 4}', or a file "
            "of it.  [default: what the daemon starts with]"
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure each pixel's gain and phase, while the light shines at the sensor (Sec. 4.2).

    Put filter and diffusor before the lens first. The file is good for this camera, sequence and
    exposure; `transientcam serve --calibration FILE` uses it.
    """
    from transientcam_driver import Sequence, open_camera

    wanted = Sequence.from_document(_document(sequence)) if sequence is not None else None
    if not output.parent.is_dir():  # said before anything is captured
        raise typer.BadParameter(f"there is no folder {output.parent}", param_hint="--output")
    with open_camera(camera) as opened:
        if wanted is not None:
            opened.configure(wanted)
        measured = _measure(opened, takes)
    measured.capture.save(output)
    result = _result(measured, output)
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    else:
        _tell(result)


def _measure(camera: "Camera", takes: int) -> "Calibration":
    from rich.progress import Progress

    import transientcam_moments as tm
    from transientcam_driver import capture_calibration
    from transientcam_server.calibration import evaluate

    with Progress(console=Console(stderr=True)) as shown:
        task = shown.add_task("capturing", total=None)
        capture = capture_calibration(
            camera,
            takes=takes,
            average=tm.average_takes,
            progress=lambda done, total: shown.update(task, completed=done, total=total),
        )
        shown.update(task, description="evaluating")
        return evaluate(capture)


def _document(text: str) -> dict[str, Any]:
    source = text if text.lstrip().startswith("{") else Path(text).read_text(encoding="utf-8")
    try:
        document = json.loads(source)
    except json.JSONDecodeError as error:
        raise typer.BadParameter(f"is no JSON: {error}", param_hint="--sequence") from error
    if not isinstance(document, dict):
        raise typer.BadParameter("is no JSON object", param_hint="--sequence")
    return document


def _result(measured: "Calibration", output: Path) -> dict[str, Any]:
    capture = measured.capture
    images, height, width = capture.images.shape
    return {
        "file": str(output),
        "calibration_id": measured.id,
        "serial": capture.serial,
        "width": width,
        "height": height,
        "temperature_c": capture.temperature_c,
        "images": images,
        "takes": len(capture.kept),
        "rejected_images": capture.rejected_images,
        "bad_pixels": int(measured.bad.sum()),
        "sequence": capture.sequence.to_document(),
    }


def _tell(result: dict[str, Any]) -> None:
    captured = result["images"] * result["takes"]
    lines = (
        f"{result['file']}: {result['calibration_id']}",
        f"  {result['width']} x {result['height']} pixels of {result['serial']} "
        f"at {result['temperature_c']:.1f} °C, {result['bad_pixels']} of them bad",
        f"  {result['rejected_images']} of {captured} images left out as outliers",
    )
    for line in lines:
        typer.echo(line)
