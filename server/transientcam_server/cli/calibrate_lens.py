"""What ``calibrate --lens`` does: measures a lens, and where a second camera stands."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import typer

from transientcam.cli.terminal import echo

if TYPE_CHECKING:
    from transientcam import Camera
    from transientcam_driver import Lens

WALL: Final = "wall"


def measure_lens(
    urls: Sequence[str],
    shown: str,
    *,
    square_m: float,
    views: int,
    takes: int,
    output: Path | None,
    token: str | None,
    as_json: bool,
) -> None:
    """Measure the lenses of one or two daemons' cameras, and print ``[lens]`` of the settings."""
    from contextlib import ExitStack

    from transientcam import Camera
    from transientcam_server.imaging import (
        Intrinsics,
        lens_of_boards,
        lens_of_walls,
        second_in_first,
    )

    board = re.fullmatch(r"(\d+)x(\d+)", shown)
    if shown != WALL and board is None:
        raise typer.BadParameter(
            "is wall, or the inner corners of a board: 9x6", param_hint="--lens"
        )
    if board is None and len(urls) > 1:
        raise typer.BadParameter("needs a board that both cameras see", param_hint="--second")
    with ExitStack() as opened:
        cameras = [opened.enter_context(Camera(url, token=token)) for url in urls]
        known = [Intrinsics.of_document(each.camera["intrinsics"]) for each in cameras]
        pictures: list[list[Any]] = [[] for _ in cameras]
        for view in range(views):
            what = (
                f"{WALL if board is None else 'board'} from side {view + 1} of {views}, then Enter"
            )
            typer.prompt(what, default="", show_default=False, err=True)
            for camera, own in zip(cameras, pictures, strict=True):
                own.append(_mean(camera, "range" if board is None else "brightness", takes))
    if board is None:
        lens, off_m = lens_of_walls(pictures[0], known[0])
        found: dict[str, Any] = {"lens": _settings(lens), "deviation_m": off_m}
    else:
        corners = int(board[1]), int(board[2])
        each = [
            lens_of_boards(own, corners, square_m, of)
            for own, of in zip(pictures, known, strict=True)
        ]
        (lens, off_px, poses), *others = each
        found = {"lens": _settings(lens), "deviation_px": off_px, "boards": _listed(poses)}
        for second, _, seen in others:
            pose = second_in_first(poses, seen)
            found |= {"second": _settings(second), "second_in_first": pose.tolist()}
    lines = ["[lens]", *(f"{name} = {json.dumps(value)}" for name, value in found["lens"].items())]
    if output is not None:
        output.write_text("\n".join(lines) + "\n", encoding="utf-8")
    rest = [
        f"# {name} = {json.dumps(found[name])}" for name in found if name not in ("lens", "boards")
    ]
    echo(json.dumps(found, indent=2) if as_json else "\n".join(lines + rest))


def _mean(camera: "Camera", product: str, takes: int) -> Any:
    """Return the mean of some frames, NaN where one has no value."""
    with camera.stream(product) as stream:
        stream.receive()  # may have begun before the board was there
        return np.mean([stream.receive().array for _ in range(takes)], axis=0, dtype=np.float64)


def _settings(lens: "Lens") -> dict[str, Any]:
    """Return a lens as the settings state it."""
    pinhole = {f"{name}_px": round(getattr(lens, name), 4) for name in ("fx", "fy", "cx", "cy")}
    return pinhole | {"distortion": [round(each, 6) for each in lens.distortion]}


def _listed(poses: Sequence[Any]) -> list[Any]:
    return [None if each is None else each.tolist() for each in poses]
