"""Intervals of predicted errors."""

import math

import numpy as np
import pytest

from transientcam_server.planning._prediction.intervals import (
    RESAMPLED,
    Figure,
    between,
    figure,
)

ERROR = Figure(median=5e-3, low=4e-3, high=6e-3, p90=9e-3, with_margin=5.3e-3)
NOISE = Figure(median=3e-3, low=2.5e-3, high=3.5e-3, p90=5e-3, with_margin=3.2e-3)
MOST = Figure(median=8e-3, low=7e-3, high=1e-2, p90=2e-2, with_margin=8.4e-3)


def test_an_interval_reaches_from_the_least_to_the_most_bias() -> None:
    found = between(ERROR, NOISE, MOST)
    assert (found.low, found.high) == (NOISE.low, MOST.high)


def test_the_ends_of_an_interval_change_no_target() -> None:
    found = between(ERROR, NOISE, MOST)
    assert (found.median, found.with_margin, found.p90) == (5e-3, 5.3e-3, 9e-3)


def test_a_figure_of_equal_pixels_is_as_wide_as_the_model_is_uncertain() -> None:
    # 8 % of spread, and the 95 % quantile of a normal variable: 1.6449 deviations
    errors_m, picks = np.full(50, 2e-3), np.zeros((RESAMPLED, 50), int)
    found = figure(errors_m, lambda each: np.asarray(np.median(each, axis=-1)), picks)
    assert found.median == found.p90 == pytest.approx(2e-3)
    assert found.high / found.median == pytest.approx(math.exp(1.6449 * 0.08), rel=1e-4)
    assert found.median / found.low == pytest.approx(math.exp(1.6449 * 0.08), rel=1e-4)


def test_fewer_pixels_widen_a_figure() -> None:
    random = np.random.default_rng(0)

    def width(count: int) -> float:
        errors_m = np.exp(np.random.default_rng(1).normal(size=count))
        picks = random.integers(0, count, (RESAMPLED, count))
        found = figure(errors_m, lambda each: np.asarray(np.median(each, axis=-1)), picks)
        return found.high / found.low

    assert width(10) > width(1000)
