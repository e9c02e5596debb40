"""Compiled light of moving surfaces: shares around points, and what there is without a compiler."""

import re
import subprocess
import sys

import numpy as np
import pytest

from transientcam_simulation.light import _compiled_chunks as compiled_chunks
from transientcam_simulation.light._compiled_point_shadows import dim_behind_ellipsoids
from transientcam_simulation.light._coverage import TOUCHING, at_border, ball_of, near_ellipsoid
from transientcam_simulation.light._shares import Around, alone, axes_of
from transientcam_simulation.scene import Ellipsoid

BALLS = [
    Ellipsoid(np.array(centre), np.array(radii))
    for centre, radii in (
        ((0.0, 1.5, 0.0), (0.2, 0.3, 0.4)),
        ((0.3, 1.2, 0.1), (0.1, 0.1, 0.2)),
        ((-0.2, 2.0, 0.2), (0.5, 0.1, 0.3)),
    )
]
APEX = np.array([0.1, 0.0, 0.05])


@pytest.mark.parametrize(
    ("count", "side"), [(1, 0), (63, 1), (64, 2), (65, 3), *((4000, side) for side in range(4))]
)
def test_points_are_dimmed_by_the_share_around_them_whatever_is_beside(
    count: int, side: int
) -> None:
    # few neighbours are far away: code that looks only near hits must follow these on each side
    random = np.random.default_rng(count)
    index = np.sort(random.integers(0, len(BALLS), count)).astype(np.int32)
    away = random.normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away = away[np.lexsort((away[:, 2], index))]  # of each surface from below: hits are together
    centre, radii = (np.array([getattr(BALLS[k], of) for k in index]) for of in ("centre", "radii"))
    x, y, z = np.ascontiguousarray((centre + radii * away).astype(np.float32).T)
    beside = np.clip(np.arange(count) + random.integers(-3, 4, (4, count)), 0, count)
    far = np.flatnonzero(random.random(count) < 0.02)
    beside[side, far] = random.integers(0, count + 1, len(far))
    around, near = beside.astype(np.int32), np.zeros(count, np.float32)
    boxes = compiled_chunks.boxes(x, y, z).reshape(2, 3, -1) - APEX.astype(np.float32)[:, None]

    clear = np.ones(count, np.float32)
    owns, reach = np.arange(len(BALLS), dtype=np.int32), Around(around).reach[0]
    points = x, y, z, near, index, around, reach, boxes.reshape(6, -1)
    dim_behind_ellipsoids(axes_of(BALLS), APEX, owns, *points, clear)

    expected = np.ones(count, np.float32)
    way = [each - np.float32(start) for each, start in zip((x, y, z), APEX, strict=True)]
    for k, ball in enumerate(BALLS):
        inside, at, squared = near_ellipsoid(ball_of(ball.centre, ball.radii, APEX), *way)
        away_m = (at - np.float32(1)) * np.sqrt(squared)
        counts = (at > TOUCHING) & (at < 1 - TOUCHING) & (index != k) & ~(away_m**2 < inside)
        values = np.append(np.where(counts, inside, np.float32(np.nan)), np.float32(np.nan))
        on, others = values[:-1] > 0, values[around]
        border = ((others > 0) != on).any(axis=0)
        share = np.where(border, at_border(values[:-1], *others)[0], on.astype(np.float32))
        expected *= 1 - share.astype(np.float32)
    assert clear.tobytes() == expected.tobytes()
    assert count < 4000 or 0 < np.mean(expected < 1) < 1


def test_a_point_with_nothing_beside_it_is_covered_or_not() -> None:
    behind = BALLS[0].centre * np.array([1.0, 2.0, 1.0]) - APEX
    x, y, z = (
        np.array([there, aside], np.float32)
        for there, aside in zip(APEX + behind, (1.0, 3.0, 1.0), strict=True)
    )
    around, clear = alone(2), np.ones(2, np.float32)
    boxes = compiled_chunks.boxes(x, y, z).reshape(2, 3, -1) - APEX.astype(np.float32)[:, None]
    of = np.zeros(2, np.float32), np.full(2, 5, np.int32), around.beside, around.reach[0]

    dim_behind_ellipsoids(
        axes_of(BALLS[:1]), APEX, np.zeros(1, np.int32), x, y, z, *of, boxes.reshape(6, -1), clear
    )

    assert clear.tolist() == [0, 1]


def test_without_a_compiler_the_error_says_what_to_install() -> None:
    code = (
        "import sys\n"
        "sys.modules['numba'] = None\n"
        "from transientcam_driver.errors import CompilerMissing\n"
        "from transientcam_simulation.light import load_compiled\n"
        "try:\n"
        "    load_compiled()\n"
        "except CompilerMissing as error:\n"
        "    print(error)\n"
    )

    printed = subprocess.check_output([sys.executable, "-c", code], text=True)

    assert re.search(r"numba.*transientcam\[simulation\]", printed)
