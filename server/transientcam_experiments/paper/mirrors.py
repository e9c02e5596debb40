"""The scene of Figures 1, 6, 8, 9 and 15, and the sequences that the paper captured it with."""

from typing import Final

import numpy as np

from transientcam_driver import Sequence
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot

TIMES_S: Final = (11.3e-9, 19.3e-9, 26.7e-9)
"""Times of flight of the frames in Figures 8 and 9."""
SEQUENCES: Final = {
    "a": Sequence(harmonics=3, base_frequency_hz=23e6, takes=1),
    "b": Sequence(harmonics=4, base_frequency_hz=23e6, takes=20),
    "c": Sequence(harmonics=8, base_frequency_hz=11.5e6, takes=40),
}
"""By the rows of Figures 8 and 9."""
SINGLE_TAKE: Final = Sequence(harmonics=4, base_frequency_hz=23e6, takes=1)
"""Of Figure 1."""


def shots(bench: Bench, sequence: Sequence, *, frames: int = 1) -> list[ReconstructedShot]:
    """Capture the mirrors."""
    return bench.shots("mirrors", sequence, frames=frames)


def title(name: str) -> str:
    """Return the title of a row of Figures 8 and 9: how it was captured."""
    sequence = SEQUENCES[name]
    takes = "1 take" if sequence.takes == 1 else f"{sequence.takes} takes"
    return (
        f"({name}) m = {sequence.harmonics}, f = {sequence.base_frequency_hz / 1e6:g} MHz, {takes}"
    )


def thrice(shot: ReconstructedShot) -> Array:
    """Return the pixels (H, W) with three returns, each of a tenth of the strongest at least."""
    weight = shot.truth.weight[:3]
    return np.asarray((weight > 0.1 * weight.max(axis=0)).all(axis=0) & shot.lit)


def returned(shot: ReconstructedShot, time_s: Array) -> Array:
    """Return the light that is really back at each pixel's time (H, W), in DN."""
    back = np.nan_to_num(shot.truth.delay_s, nan=np.inf) <= time_s
    light: Array = np.where(back, shot.truth.weight, 0).sum(axis=0)
    return light
