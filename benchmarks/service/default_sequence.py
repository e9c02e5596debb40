"""What the daemon starts with, beside other sequences: time, accuracy and flagged pixels."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from benchmarks.common.tables import Cell, Column, Table
from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera.source import sensor_of
from transientcam_server.imaging.deviation import MEDIAN_OF_NORMAL
from transientcam_server.imaging.noise import contradictions
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.settings import ReconstructionSettings, SensorSettings, SequenceSettings

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


def row(scene: str, sequence: Sequence) -> tuple[Cell, ...]:
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
    is_default = sequence == Sequence(**SequenceSettings().model_dump())
    name = (
        f"m = {sequence.harmonics}, {sequence.exposure_s * 1e3:g} ms, {sequence.zeroth}"
        f"{' (default)' if is_default else ''}"
    )
    return (
        name,
        applied.capture_s * 1e3,
        1e3 * deviation_m(range_m),
        1e3 * np.nanmedian(np.abs(np.nanmean(range_m, axis=0) - truth)),
        np.mean(flags & tm.Flags.BIASED > 0),
        np.mean(seen) if seen else None,
        np.mean(flags & (255 - tm.Flags.BIASED) > 0),
    )


def deviation_m(range_m: _Array) -> float:
    """Return the typical difference of two captures, as that of a normal distribution.

    See docs/decisions/0521: a few pixels that jump between returns do not decide it.
    """
    apart = np.abs(np.diff(range_m, axis=0))
    return float(np.nanmedian(apart) / (np.sqrt(2) * MEDIAN_OF_NORMAL))


def tables() -> Iterator[Table]:
    """Try all candidates before each scene; capture times are the camera's own."""
    columns = (
        "sequence",
        Column("capture ms", ".0f"),
        Column("deviation mm", ".2f"),
        Column("median error mm", ".2f"),
        Column("biased", ".1%"),
        Column("contradictory", ".2%"),
        Column("otherwise flagged", ".1%"),
    )
    for scene in SCENES:
        yield Table(scene, columns, [row(scene, each) for each in candidates()])
