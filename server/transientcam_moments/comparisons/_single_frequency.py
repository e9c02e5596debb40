"""One return from one frequency, as any AMCW lidar camera takes it."""

import numpy as np

from transientcam_moments.arrays import Array
from transientcam_moments.comparisons._estimate import SparseEstimate
from transientcam_moments.comparisons._pixels import pixels_of
from transientcam_moments.comparisons._technique import Technique


def single_frequency(b: Array) -> SparseEstimate:
    """Estimate one return at arg b_1 of weight |b_1|; nothing else is looked at."""
    pixels = pixels_of(b, least=1, name="single-frequency", last=1)
    first = pixels.b[1:2]
    return pixels.sparse(np.angle(first), np.abs(first))


TECHNIQUE = Technique(
    name="single-frequency",
    label="single frequency",
    returns="1",
    frequencies="f",
    harmonics=lambda m: (1,),
    least_harmonics=1,
    assumptions="All light takes the same way.",
    cost="One arctangent.",
    failure="Light on other ways pulls the phase towards itself: the range is too long under "
    "indirect light, and nothing says so.",
    estimate=single_frequency,
)
