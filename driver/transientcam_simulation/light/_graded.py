"""Patches that are smaller where the light that surfaces give each other changes.

As in a crease, or in the shadow at the foot of something. Where a row or a column of patches is
off the straight line through its neighbours, which is what pixels take between them, it is halved.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from transientcam_simulation.light._exchange import Exchange
from transientcam_simulation.light._patches import Cuts, Patches, contour
from transientcam_simulation.scene import Rectangle, Scene, evenly, most_patches, patches_of

Values = NDArray[np.float64]
_OFF: Final = 1e-3
"""Of the highest radiosity: a tenth of the noise of a moment of some thousand electrons."""
_FIRST_PER_SIDE: Final = 12  # patches along the longest side, at first
_FEWEST: Final = 3  # rows and columns, to see a bend
_ROUNDS: Final = 4
_BOUNCES: Final = 2  # judged
_AFFORDED: Final = 1500  # patches, at most so many times as many as the scene says
_TIMES: Final = 8
_HIGHEST_HZ: Final = 150e6
_TOUCHES: Final = 1e-6  # of a plane's size
_NEAR: Final = 0.25  # of the mean distance of cuts
_LEAST: Final = 1e-6  # share of the view, of patches that are halved where not all can be, ...
_HIGHER: Final = 1.25  # and how much larger they are next


def graded(scene: Scene, per_side: int) -> Exchange:
    """Find the light between patches of a scene that stands still, over mirrors, too.

    Of as many as if its longest side were cut into ``per_side`` equal ones, or can be afforded.
    """
    equal = patches_of(scene, per_side)
    most = min(max(equal, min(_AFFORDED, _TIMES * equal)), most_patches(scene))
    patches = Patches.of(scene, min(per_side, max(_FIRST_PER_SIDE, per_side // 2)))
    cuts = {
        k: _where_others_stand(
            scene, k, evenly(max(_FEWEST, cells.rows)), evenly(max(_FEWEST, cells.columns))
        )
        for k, cells in patches.cells.items()
    }
    first = _count(cuts)
    exchange = Exchange.between(scene, Patches.cut(scene, cuts))
    for step in range(1, _ROUNDS + 1):
        # the same share more in each round, so that what is off most is halved most often
        finer = _finer(exchange, first * (most / first) ** (step / _ROUNDS))
        last = step == _ROUNDS
        if last or _count(finer) > len(exchange.patches):
            exchange = Exchange.between(scene, Patches.cut(scene, finer), moves=not last)
    return exchange.with_reflections()


def _where_others_stand(scene: Scene, index: int, up: Values, along: Values) -> Cuts:
    """Cut a plane also along edges of other ones that stand on it: light changes at once there."""
    plane = scene.surfaces[index].shape
    if not isinstance(plane, Rectangle):
        return up, along
    cuts = {"up": up, "along": along}
    for other in scene.surfaces:
        if other is scene.surfaces[index] or not isinstance(other.shape, Rectangle):
            continue
        off = other.shape.extent() - plane.centre
        stands = np.abs(off @ plane.normal) < _TOUCHES * max(plane.width, plane.height)
        x, y = off @ plane.right / (plane.width / 2), off @ plane.up / (plane.height / 2)
        for corner in range(4):
            pair = [corner, (corner + 1) % 4]
            if not stands[pair].all():
                continue
            for name, at in (("along", x[pair]), ("up", y[pair])):
                if abs(at[1] - at[0]) < _TOUCHES and abs(at[0]) < 1:
                    cuts[name] = _cut_at(cuts[name], at[0])
    return cuts["up"], cuts["along"]


def _cut_at(cuts: Values, place: float) -> Values:
    """Cut there too, or move the cut that is near to it."""
    off = np.abs(cuts - place)
    near = 1 + int(off[1:-1].argmin())
    beside = off.min() < _NEAR * (2 / (len(cuts) - 1))
    if beside and off[near] > off.min():  # the plane's own end
        return cuts
    return np.sort(np.append(np.delete(cuts, near) if beside else cuts, place))


def _count(cuts: dict[int, Cuts]) -> int:
    return sum((len(up) - 1) * (len(along) - 1) for up, along in cuts.values())


def _finer(exchange: Exchange, most: float) -> dict[int, Cuts]:
    """Return where to cut, more finely but into no more than so many patches."""
    patches = exchange.patches
    direct = exchange.radiosity.sum(axis=(0, 2))
    bounces = min(_BOUNCES, exchange.bounces(_OFF * float(direct.max())))
    got = np.stack([exchange.irradiance(f, bounces) for f in (0.0, _HIGHEST_HZ)])
    light = patches.albedo * got
    limit, seen = _OFF * float((direct + light[0].real).max()), _shown(exchange)
    worth = {}
    for k, cells in patches.cells.items():
        mine = slice(patches.first[k], patches.first[k] + len(cells.centre))
        rows = light[:, mine].reshape(-1, cells.rows, cells.columns)
        shown = seen[mine].reshape(cells.rows, cells.columns)
        up = (_off(rows, cells.up) > limit) * shown
        along = (_off(rows.swapaxes(1, 2), cells.along) > limit) * shown.T
        worth[k] = up.max(axis=1), along.max(axis=1)
    least = 0.0
    while True:
        cuts = {
            k: (_halved(each.up, worth[k][0] > least), _halved(each.along, worth[k][1] > least))
            for k, each in patches.cells.items()
        }
        if _count(cuts) <= max(most, len(patches)):
            return cuts
        least = max(_HIGHER * least, _LEAST)


def _shown(exchange: Exchange) -> NDArray[np.float64]:
    """Return how large each patch (N) is to the camera, at least an average one behind mirrors."""
    scene, camera = exchange.scene, exchange.scene.camera
    assert camera is not None  # noqa: S101  (a scene of surfaces has one)
    corners, axis = exchange.patches.corners, camera.look_at_m - camera.position_m
    shown = contour(corners - camera.position_m, np.broadcast_to(axis, (len(corners), 3)))
    mirrors = any(each.kind == "mirror" for each in scene.surfaces)
    return np.maximum(shown, shown.mean()) if mirrors else shown


def _off(light: NDArray[np.complex128], cuts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far light (F, R, C) between rows' middles may be off a straight line, (R, C).

    A parabola is off the line from neighbour to neighbour by four times as much as within a row,
    and off the line that two rows go on in by 8 / 3 times.
    """
    middles, last = (cuts[1:] + cuts[:-1]) / 2, len(cuts) - 2
    row = np.arange(last + 1)
    lower, upper = row - 1, row + 1
    lower[[0, last]], upper[[0, last]] = (1, last - 2), (2, last - 1)
    share = (middles - middles[lower]) / (middles[upper] - middles[lower])
    line = light[:, lower] + share[:, None] * (light[:, upper] - light[:, lower])
    off: NDArray[np.float64] = np.abs(light - line).max(axis=0) / 4
    off[[0, last]] *= 1.5
    return off


def _halved(cuts: NDArray[np.float64], which: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.sort(np.concatenate([cuts, ((cuts[1:] + cuts[:-1]) / 2)[which]]))
