"""From light on a grid of phases to returns."""

from collections.abc import Sequence

import numpy as np

from transientcam_moments.comparisons.estimate import Real

_FAINT = 1e-7  # of the brightest bin: what solvers leave of zero


def cluster(light: Real | None) -> tuple[Real, Real] | None:
    """Return phases (K) and weights (K) of the runs of lit bins k 2 pi / bins, around the turn."""
    if light is None or not light.max() > 0:
        return None
    lit = light > _FAINT * light.max()
    if lit.all():
        lit = light > light.min()  # no run begins anywhere
    begins = lit & ~np.roll(lit, 1)
    if not begins.any():
        return None
    first = int(begins.argmax())  # no run goes across this bin
    lit, light = np.roll(lit, -first), np.roll(light, -first)
    run = np.cumsum(lit & ~np.roll(lit, 1)) - 1
    kept = np.where(lit, light, 0)
    weight = np.bincount(run, kept)
    centre = np.bincount(run, kept * np.arange(light.size)) / weight
    return (first + centre) * (2 * np.pi / light.size), weight


def stacked(found: Sequence[tuple[Real, Real] | None]) -> tuple[Real, Real]:
    """Put the returns of pixels side by side: phases and weights (K, P), K the most of any."""
    most = max((len(each[0]) for each in found if each is not None), default=1)
    phase, weight = np.full((most, len(found)), np.nan), np.zeros((most, len(found)))
    for pixel, each in enumerate(found):
        if each is not None:
            phase[: len(each[0]), pixel], weight[: len(each[1]), pixel] = each
    return phase, weight
