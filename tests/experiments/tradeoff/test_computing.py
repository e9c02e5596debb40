"""Computing tasks: their references and their times."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.experiments.tradeoff.moments import moments
from transientcam_driver import Sequence
from transientcam_experiments import tradeoff
from transientcam_experiments.tradeoff import computing

SMALL = tradeoff.Grid(tuple(Sequence(harmonics=m) for m in (1, 2, 3, 4)), (2,), (16,))
Array = NDArray[Any]


@pytest.mark.parametrize("m", [2, 4])
def test_every_computing_task_is_near_its_reference_and_timed_by_the_clock(m: int) -> None:
    grid = replace(SMALL, harmonics=(m,))
    for task in computing.tasks(m, grid):
        ticks = map(float, range(100))
        values, spread = computing.measure(task, moments(m), repetitions=3, clock=ticks.__next__)

        assert values["seconds"] == 1.0
        assert spread["seconds"] == 0.0
        exact = task.point["dtype"] == "float64"
        loose = "quadrature" in task.point["method"]
        limit = 0.6 if loose else 1e-10 if exact else 1e-3
        assert 0 <= (values["error_worst"] or 0) < limit, dict(task.point)


def test_fifty_digits_and_double_precision_say_the_same_of_light() -> None:
    (task,) = [
        each
        for each in computing.tasks(3, SMALL)
        if each.point["task"] == "cumulative" and each.point["dtype"] == "float64"
    ]
    b = moments(3)

    exact = task.exact(b)

    # until a full turn all of it has come back
    assert exact.shape == (16, computing.EXACT_PIXELS)
    assert (np.diff(exact, axis=0) >= 0).all()
    assert (exact[-1] < b[0].real[: computing.EXACT_PIXELS]).all()
