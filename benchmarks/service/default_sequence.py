"""What the daemon starts with, beside other sequences: time, accuracy and flagged pixels."""

from collections.abc import Iterator
from typing import Final

import numpy as np

import transientcam_moments as tm
from benchmarks.accuracy.capturing import SEED, captured
from benchmarks.common.tables import Cell, Table, heads
from transientcam_driver import Sequence
from transientcam_experiments.tradeoff import camera_before
from transientcam_experiments.tradeoff.capture import repeatability
from transientcam_server.imaging._errors_of_range.noise import contradictions
from transientcam_server.settings import SequenceSettings

FRAMES: Final = 16
SCENES: Final = ("mirrors", "wall")


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
    with camera_before(scene, seed=SEED) as camera:
        recipe, found = captured(camera, sequence, FRAMES)
        assert camera.simulation is not None
        truth = np.asarray(camera.simulation.truth().range_m)
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
        recipe.applied.capture_s * 1e3,
        1e3 * (repeatability(range_m) or 0.0),
        1e3 * np.nanmedian(np.abs(np.nanmean(range_m, axis=0) - truth)),
        np.mean(flags & tm.Flags.BIASED > 0),
        np.mean(seen) if seen else None,
        np.mean(flags & (255 - tm.Flags.BIASED) > 0),
    )


def tables() -> Iterator[Table]:
    """Try all candidates before each scene; capture times are the camera's own."""
    columns = heads(
        "sequence | capture ms:.0f | deviation mm:.2f | median error mm:.2f | biased:.1% | "
        "contradictory:.2% | otherwise flagged:.1%"
    )
    for scene in SCENES:
        yield Table(scene, columns, [row(scene, each) for each in candidates()])
