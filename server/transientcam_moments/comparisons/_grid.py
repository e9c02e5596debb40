"""From light on a grid of phases to returns."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from transientcam_moments.comparisons._estimate import Real

_FAINT = 1e-7  # of the brightest bin: what solvers leave of zero


def cluster(light: Real | None, *, gap: int = 0) -> tuple[Real, Real] | None:
    """Return phases (K) and weights (K) of the runs of lit bins k 2 pi / bins, around the turn.

    Up to `gap` dark bins do not end a run. Each becomes a return at its centroid.
    """
    if light is None or not light.max() > 0:
        return None
    lit = np.flatnonzero(light > _FAINT * light.max())
    apart = np.diff(lit, append=lit[0] + light.size)  # to the next one
    ends = apart > gap + 1
    if not ends.any():
        ends[apart.argmax()] = True
    first = int(ends.argmax()) + 1  # no run goes across here
    lit, ends = np.roll(lit, -first), np.roll(ends, -first)
    place = np.unwrap(lit.astype(float), period=light.size)
    run: NDArray[np.int_] = np.cumsum(ends) - ends
    weight = np.bincount(run, light[lit]).astype(float)
    centre = np.bincount(run, light[lit] * place) / weight
    return centre * (2 * np.pi / light.size), weight


def stacked(found: Sequence[tuple[Real, Real] | None]) -> tuple[Real, Real]:
    """Put the returns of pixels side by side: phases and weights (K, P), K the most of any."""
    most = max((len(each[0]) for each in found if each is not None), default=1)
    phase, weight = np.full((most, len(found)), np.nan), np.zeros((most, len(found)))
    for pixel, each in enumerate(found):
        if each is not None:
            phase[: len(each[0]), pixel], weight[: len(each[1]), pixel] = each
    return phase, weight
