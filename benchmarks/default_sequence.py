"""What the daemon starts with, beside other sequences: time, accuracy and flagged pixels.

Run it with ``python -m benchmarks.default_sequence [--write]``; ``--write`` keeps the page in
docs/. Nothing is timed: capture times are the camera's own.
"""

import argparse
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

import transientcam_moments as tm
from benchmarks.tables import Table
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.imaging import MEDIAN_OF_NORMAL, Recipe
from transientcam_server.imaging._errors_of_range.noise import contradictions
from transientcam_server.settings import ReconstructionSettings, SensorSettings, SequenceSettings

PAGE = Path(__file__).parents[1] / "docs" / "default-sequence.md"
COMMAND: Final = "python -m benchmarks.default_sequence --write"
FRAMES: Final = 16
SCENES: Final = ("mirrors", "wall")
_Array = NDArray[Any]


def candidates() -> list[Sequence]:
    """Return the former default, the present one, and others that take about as long."""
    return [
        Sequence(harmonics=3, zeroth="low-frequency", exposure_s=0.00192),
        Sequence(harmonics=3, zeroth="estimated", exposure_s=0.00192),
        Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0037),
        Sequence(harmonics=4, zeroth="estimated", exposure_s=0.001),
        Sequence(harmonics=4, zeroth="estimated", exposure_s=0.0015),
        Sequence(**SequenceSettings().model_dump()),
        Sequence(harmonics=4, zeroth="on-off", exposure_s=0.00192),
        Sequence(harmonics=5, zeroth="estimated", exposure_s=0.0005),
        Sequence(harmonics=5, zeroth="estimated", exposure_s=0.001),
        Sequence(harmonics=6, zeroth="estimated", exposure_s=0.0005),
    ]


def row(scene: str, sequence: Sequence) -> tuple[str, ...]:
    """Capture frames of a scene and say what came of them."""
    with open_camera(f"sim:{scene}", clock=VirtualClock()) as camera:
        applied = camera.configure(sequence)
        assert camera.simulation is not None
        sensor = sensor_of(camera, SensorSettings())
        recipe = Recipe(applied, ReconstructionSettings(), 65535.0, sensor=sensor)
        camera.start()
        truth = np.asarray(camera.simulation.truth().range_m)
        found = [recipe.reconstruct(camera.read_frame()) for _ in range(FRAMES)]
    range_m = np.stack([np.asarray(each.range_m) for each in found])
    flags = np.stack([np.asarray(each.flags) for each in found])
    wrong = [contradictions(recipe, each) for each in found]
    seen = [each for each in wrong if each is not None]
    contradictory = float(np.mean(seen)) if seen else np.nan
    is_default = sequence == Sequence(**SequenceSettings().model_dump())
    name = (
        f"m = {sequence.harmonics}, {sequence.exposure_s * 1e3:g} ms, {sequence.zeroth}"
        f"{' (default)' if is_default else ''}"
    )
    return (
        name,
        f"{applied.capture_s * 1e3:.0f}",
        f"{1e3 * deviation_m(range_m):.2f}",
        f"{1e3 * np.nanmedian(np.abs(np.nanmean(range_m, axis=0) - truth)):.2f}",
        f"{np.mean(flags & tm.Flags.BIASED > 0):.1%}",
        "–" if np.isnan(contradictory) else f"{contradictory:.2%}",
        f"{np.mean(flags & (255 - tm.Flags.BIASED) > 0):.1%}",
    )


def deviation_m(range_m: _Array) -> float:
    """Return the typical difference of two captures, as that of a normal distribution.

    See decision 8: a few pixels that jump between returns do not decide it.
    """
    apart = np.abs(np.diff(range_m, axis=0))
    return float(np.nanmedian(apart) / (np.sqrt(2) * MEDIAN_OF_NORMAL))


def table(scene: str) -> Table:
    """Try all candidates before a scene."""
    found = Table(
        scene,
        (
            "sequence",
            "capture ms",
            "deviation mm",
            "median error mm",
            "biased",
            "contradictory",
            "otherwise flagged",
        ),
    )
    found.rows.extend(row(scene, each) for each in candidates())
    return found


_INTRODUCTION = f"""# The default sequence

Written by `{COMMAND}`: {FRAMES} frames of simulated cameras, 163 x 120 pixels,
settings of the reconstruction as they come. The numbers do not depend on the machine.

*deviation* is the typical difference of the ranges of two frames, scaled to a normal
distribution's; *median error* is the median over the pixels of the mean range's error.
`biased` is [normal](stream.md#products);
`contradictory` is not, and cannot be seen where the zeroth moment is estimated.

"""


def main() -> None:
    """Try all candidates, print them, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write docs/default-sequence.md")
    arguments = parser.parse_args()
    tables = [table(scene) for scene in SCENES]
    for each in tables:
        each.show(Console(width=140))
    if arguments.write:
        text = _INTRODUCTION + "\n".join(each.markdown() for each in tables)
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
