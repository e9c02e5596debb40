"""The scene of Figures 13 and 14, and the moments of its transient video that they show."""

from typing import Final

import numpy as np

from transientcam_driver import Sequence
from transientcam_experiments.paper.bench import Array, Bench, ReconstructedShot

VIDEO: Final = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.0005)
"""Three frequencies, no zeroth moment: twelve images of 0.5 ms (Sec. 6.3)."""
VIDEO_HZ: Final = 18.6
MOMENTS_S: Final = (4.8, 7.6, 17.0)
"""When our actor enters, waves and leaves; the paper shows 4.8 s, 7.6 s and 13 s of its actor."""


def video(bench: Bench) -> dict[float, list[ReconstructedShot]]:
    """Return two successive frames at each moment, or at the first two for a first look."""
    return {
        at_s: bench.shots("visitor", VIDEO, frames=2, at_s=at_s)
        for at_s in MOMENTS_S[: bench.few(3, 2)]
    }


def parts(shot: ReconstructedShot) -> dict[str, Array]:
    """Return the pixels (H, W) of the actor, of the wall, and of the wall lit over mirrors."""
    first = shot.truth.delay_s[0]
    actor = shot.lit & (first < 12.8e-9)
    later = (np.nan_to_num(shot.truth.delay_s[1:], nan=0.0) > 20e-9).any(axis=0)
    wall = shot.lit & ~actor
    return {"actor": actor, "wall": wall, "wall over two mirrors": wall & later}
