"""What averaging over time is worth: the Allan deviation of the range."""

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.errors import InputError

_PIXELS: Final = 4096
_FEWEST: Final = 8
"""Averages that fit into the frames, at least."""


def stability(frames: Iterable[tuple[float, NDArray[Any]]]) -> dict[str, Any]:
    """Return how far averages of ranges are off, by averaging time, as JSON.

    The overlapping Allan deviation (IEEE Std 1139) of the median pixel and of nine in ten: noise
    falls with the root of the time, drift and motion rise, and the least is the best time.

    ``frames``: time in s and range in m (H, W) of frames in succession, which are taken as even. Of
    pixels that have a range in all of them 4096 are used.
    Raises InputError for less than 16 frames, or where no pixel is left.
    """
    times_s, ranges_m = zip(*frames, strict=True)
    seen = np.array([each.ravel()[:: -(-each.size // _PIXELS)] for each in ranges_m])
    seen = seen[:, np.isfinite(seen).all(axis=0)]
    count, pixels = seen.shape
    if not pixels or count < 2 * _FEWEST:
        found = f"{count} frames, {pixels} pixels with a range in each"
        raise InputError("frames", "range", found, f"{2 * _FEWEST} frames, and a pixel, at least")
    every_s, most = (times_s[-1] - times_s[0]) / (count - 1), count // _FEWEST
    counts = sorted({round(each) for each in np.geomspace(1, most, 3 * most.bit_length())})
    summed = np.concatenate([np.zeros((1, pixels)), np.cumsum(seen - seen[0], axis=0)])
    both_m = []
    for n in counts:
        means = (summed[n:] - summed[:-n]) / n
        deviation_m = np.sqrt(np.mean((means[n:] - means[:-n]) ** 2, axis=0) / 2)
        both_m.append(np.quantile(deviation_m, (0.5, 0.9)))
    median_m, p90_m = np.array(both_m).T.tolist()
    best = int(np.argmin(median_m))
    return {
        "frames": count,
        "pixels": pixels,
        "averaging_s": [n * every_s for n in counts],
        "median_m": median_m,
        "p90_m": p90_m,
        "noise_alone_m": [median_m[0] / n**0.5 for n in counts],
        "best_averaging_s": counts[best] * every_s,
        "best_frames": counts[best],
        "longer_may_help": best == len(counts) - 1,
    }
