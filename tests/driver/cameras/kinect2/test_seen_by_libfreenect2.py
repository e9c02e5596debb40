"""The emulated camera's frames, held against what libfreenect2 itself read of them over USB.

`python -m benchmarks by_libfreenect2` stored that, with libfreenect2 commit fd64c5d.
"""

import numpy as np
import pytest

from benchmarks.kinect2 import seen


@pytest.mark.parametrize("scene", seen.SCENES)
def test_infrared_and_depth_of_the_emulation_are_those_that_libfreenect2_gave(scene: str) -> None:
    frame, theirs = seen.Seen.of(scene), seen.stored(scene)
    depth_mm, infrared = frame.depth_mm(), frame.infrared()

    given = theirs["depth_mm"] > 0
    # a pixel at a border of decision may go the other way on another processor
    assert ((depth_mm > 0) == given).mean() > 0.995
    both = given & (depth_mm > 0)
    assert np.abs(depth_mm - theirs["depth_mm"])[both].max() < 0.1
    assert np.abs(infrared - theirs["ir"]).max() < 0.1  # of 65 535, in single precision
