"""What averaging over time is worth: the Allan deviation of the range."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.errors import Problem, kinds

PIXELS: Final = 4096
"""Of a picture, spread evenly, at most."""
_FEWEST: Final = 8
"""Averages that fit into the frames, at least."""


def stability(ranges_m: Sequence[NDArray[Any]], times_s: Sequence[float]) -> dict[str, Any]:
    """Return how far averages of ranges are off, by averaging time, as JSON.

    The overlapping Allan deviation (IEEE Std 1139): noise falls with the root of the averaging
    time, drift and motion rise with it, and the least is the best averaging time.

    Parameters
    ----------
    ranges_m
        (P) of frames in succession; pixels that have none in a frame are left out.
    times_s
        Of the frames, which are taken as even.

    Raises
    ------
    Problem
        ``invalid-request`` for less than 16 frames, or where no pixel is left.
    """
    seen = np.array(ranges_m).reshape((len(times_s), -1))
    seen = seen[:, np.isfinite(seen).all(axis=0)]
    frames, pixels = seen.shape
    if not pixels or frames < 2 * _FEWEST:
        detail = "There are too few frames, or no pixel has a range in each of them."
        raise Problem(
            kinds.INVALID_REQUEST, detail, field="frames", value=frames, limit=2 * _FEWEST
        )
    every_s = (times_s[-1] - times_s[0]) / (frames - 1)
    most = frames // _FEWEST
    counts = sorted({round(each) for each in np.geomspace(1, most, 3 * most.bit_length())})
    summed = np.concatenate([np.zeros((1, pixels)), np.cumsum(seen - seen[0], axis=0)])
    lines = []
    for n in counts:
        means = (summed[n:] - summed[:-n]) / n
        deviation_m = np.sqrt(np.mean((means[n:] - means[:-n]) ** 2, axis=0) / 2)
        lines.append([n * every_s, *np.quantile(deviation_m, (0.5, 0.9))])
    averaging_s, median_m, p90_m = np.array(lines).T.tolist()
    best = int(np.argmin(median_m))
    return {
        "frames": frames,
        "every_s": every_s,
        "pixels": pixels,
        "averaging_s": averaging_s,
        "median_m": median_m,
        "p90_m": p90_m,
        "noise_alone_m": [median_m[0] / n**0.5 for n in counts],
        "best_averaging_s": averaging_s[best],
        "best_frames": counts[best],
        "longer_may_help": best == len(counts) - 1,
    }
