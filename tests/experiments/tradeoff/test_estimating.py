"""Techniques on the same moments: errors and times."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_experiments.tradeoff import estimating

Array = NDArray[Any]


def test_every_technique_that_has_enough_harmonics_is_timed_and_held_against_the_truth() -> None:
    names = {m: [each.name for each, _ in estimating.points(m)] for m in (1, 3, 8)}
    assert {"pisarenko", "single-frequency", "sra"} <= set(names[1])
    assert "godbaz" not in names[3]
    assert {"godbaz", "spumic", "dorrington", "regularised"} <= set(names[8])
    assert "coded" not in names[8]

    # two returns 1 rad apart, of which the first is the wall
    phase = np.linspace(1.0, 2.0, 300).reshape((1, 15, 20))
    phase = np.concatenate([phase, phase + 1.0])
    b = (np.exp(1j * np.arange(9)[:, None, None, None] * phase) * [[[1.0]], [[0.6]]]).sum(axis=1)
    truth_m = np.where(phase[0] < 1.9, tm.range_m(phase[0], 23e6), np.nan)
    scene = estimating.Scene(b, 23e6, truth_m)
    errors = {}
    for technique, point in estimating.points(8):
        if technique.name not in ("pisarenko", "single-frequency", "sra"):
            continue
        ticks = (0.1 * each for each in range(100))
        values, spread = estimating.measure(
            technique, scene, repetitions=3, seed=1, clock=ticks.__next__
        )
        errors[technique.name] = values["range_median_m"] or 0.0
        assert point["estimator"] == technique.name
        assert values["range_missing"] == 0.0
        # a tick for the frame, or for a sample of it
        share = 0.1 if technique.planar else 0.1 * 300 / estimating.SAMPLE_PIXELS
        assert values["seconds"] == pytest.approx(share)
        assert (spread["seconds"] is None) is not technique.planar
    assert errors["pisarenko"] < 1e-9
    assert 1e-6 < errors["sra"] < 0.05
    assert errors["single-frequency"] > 0.2
