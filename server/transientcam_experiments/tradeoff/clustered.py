"""Points that a cluster measures: captures, which are the same on any machine.

What is timed would be wrong beside other work, so that it stays with the process of the command.
"""

from collections.abc import Callable
from contextlib import closing
from functools import lru_cache
from typing import Any, Final

import transientcam_moments as tm
from transientcam_experiments.tradeoff.grid import Grid
from transientcam_experiments.tradeoff.measuring import Bench, points_of
from transientcam_experiments.tradeoff.records import Record, Records
from transientcam_server.offline import installed, require_versions

UNTIMED: Final = "capture"
Versions = tuple[tuple[str, str], ...]


def measure_on(
    client: Any,
    grid: Grid,
    records: Records,
    *,
    scene: str,
    repetitions: int,
    seed: int,
    progress: Callable[[str], None],
) -> None:
    """Measure the captures that are not in the records yet; these get them in the grid's order.

    ``client``: a `distributed.Client` of the cluster, whose workers read a scene that is a file.
    ``grid``, ``scene``, ``repetitions``, ``seed``: as of `points_of`.
    ``progress``: called with the kind of each point as it is done.
    Raises MixedVersions, ClusterError where the cluster cannot do it; and as `measure`.
    """
    from transientcam_server.offline import completed

    points = points_of(grid, scene=scene, repetitions=repetitions, seed=seed)
    left = [
        number
        for number, point in enumerate(points)
        if point.kind == UNTIMED and point.key not in records
    ]
    tasks = [(grid, scene, repetitions, seed, number, installed()) for number in left]
    waiting: dict[int, Record] = {}
    written = 0
    with closing(completed(client, measured, tasks)) as results:
        for task, record in results:
            waiting[task[-2]] = record
            progress(record.kind)
            while written < len(left) and left[written] in waiting:
                records.append(waiting.pop(left[written]))
                written += 1


def measured(
    grid: Grid, scene: str, repetitions: int, seed: int, number: int, versions: Versions
) -> Record:
    """Measure one point of a grid: what a task is."""
    require_versions(versions)
    tm.kernels.use_one_thread()  # a worker has a process, or a thread, for every core
    point = points_of(grid, scene=scene, repetitions=repetitions, seed=seed)[number]
    return point.measured(_bench(scene, seed))


@lru_cache(maxsize=2)
def _bench(scene: str, seed: int) -> Bench:
    """Return the bench that a process keeps for its tasks."""
    return Bench(scene, seed=seed)
