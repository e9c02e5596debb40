"""Patches that are smaller where the light that surfaces give each other changes.

As in a crease, or in the shadow at the foot of something. Where a row or a column of patches is
off the straight line through its neighbours, which is what pixels take between them, it is halved.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Cuts, Patches
from transientcam_simulation.scene import Scene, evenly, most_patches, patches_of

_OFF: Final = 1e-3
"""Of the highest radiosity: a tenth of the noise of a moment of some thousand electrons."""
_FIRST_PER_SIDE: Final = 12  # patches along the longest side, at first
_FEWEST: Final = 3  # rows and columns, to see a bend
_ROUNDS: Final = 4
_MOST_TIMES: Final = 2.0  # as many patches as the scene says
_AFFORDED: Final = 1600  # patches, in any scene
_HIGHEST_HZ: Final = 150e6
_HIGHER: Final = 1.5  # limit, where there would be too many patches


def graded(scene: Scene, per_side: int) -> Exchange:
    """Find the light between patches of a scene that stands still, over mirrors, too.

    Of at most twice as many patches as if its longest side were cut into ``per_side`` equal ones.
    """
    most = min(max(_MOST_TIMES * patches_of(scene, per_side), _AFFORDED), most_patches(scene))
    patches = Patches.of(scene, min(per_side, max(_FIRST_PER_SIDE, per_side // 2)))
    cuts: dict[int, Cuts] | None = {
        k: (evenly(max(_FEWEST, cells.rows)), evenly(max(_FEWEST, cells.columns)))
        for k, cells in patches.cells.items()
    }
    for _round in range(_ROUNDS):
        if cuts is None:
            break
        exchange = Exchange.between(scene, Patches.cut(scene, cuts), mirrors=True)
        cuts = _finer(exchange, most)
    return exchange


def _finer(exchange: Exchange, most: float) -> dict[int, Cuts] | None:
    """Return where to cut more finely, within so many patches; None if nowhere."""
    patches = exchange.patches
    direct = exchange.radiosity.sum(axis=(0, 2))
    bounces = exchange.bounces(_OFF * float(direct.max()))
    got = np.stack([exchange.irradiance(f, bounces) for f in (0.0, _HIGHEST_HZ)])
    light = patches.albedo * got
    limit = _OFF * float((direct + light[0].real).max())
    off = {}
    for k, cells in patches.cells.items():
        mine = light[:, patches.first[k] :][:, : len(cells.area)]
        rows = mine.reshape(-1, cells.rows, cells.columns)
        off[k] = _off(rows, cells.up), _off(rows.swapaxes(1, 2), cells.along)
    while True:
        cuts = {
            k: (_halved(each.up, off[k][0] > limit), _halved(each.along, off[k][1] > limit))
            for k, each in patches.cells.items()
        }
        count = sum((len(up) - 1) * (len(along) - 1) for up, along in cuts.values())
        if count <= max(most, len(patches)):
            return cuts if count > len(patches) else None
        limit *= _HIGHER


def _off(light: NDArray[np.complex128], cuts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far light (F, R, C) between rows' middles may be off a straight line, at most.

    A parabola is off the line from neighbour to neighbour by four times as much as within a row,
    and off the line that two rows go on in by 8 / 3 times.
    """
    middles, last = (cuts[1:] + cuts[:-1]) / 2, len(cuts) - 2
    row = np.arange(last + 1)
    lower, upper = row - 1, row + 1
    lower[[0, last]], upper[[0, last]] = (1, last - 2), (2, last - 1)
    share = (middles - middles[lower]) / (middles[upper] - middles[lower])
    line = light[:, lower] + share[:, None] * (light[:, upper] - light[:, lower])
    off: NDArray[np.float64] = np.abs(light - line).max(axis=(0, 2)) / 4
    off[[0, last]] *= 1.5
    return off


def _halved(cuts: NDArray[np.float64], which: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.sort(np.concatenate([cuts, ((cuts[1:] + cuts[:-1]) / 2)[which]]))
