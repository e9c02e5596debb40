"""Intervals of predicted errors."""

import math
from typing import Any

import numpy as np
import pytest

from transientcam_server.planning._prediction.measures import (
    RESAMPLED,
    Figure,
    _widened,
    between,
    figure,
    resampled,
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


def first(errors_m: Any) -> Any:
    """Stands for the median: what it is of a sample is then up to the test."""
    return errors_m[..., 0]


def test_the_ends_of_an_interval_add_sampling_and_model_as_independent() -> None:
    """Of samples whose medians are 1, 2, ... 101 times the least."""
    errors_m = 1e-3 * np.arange(1, 102)
    picks = np.repeat(np.arange(101)[:, None], 101, axis=1)
    errors_m = np.roll(errors_m, -20)  # the median of the pixels is 21 mm

    found = figure(errors_m, first, np.roll(picks, 20, axis=0), spread=0.1)

    def end(sampled: float, deviations: float) -> float:
        apart = math.hypot(math.log(sampled / 21), deviations * 0.1)
        return 21e-3 * math.exp(math.copysign(apart, deviations))

    # quantiles of 1 ... 101 are 6, 96 and 91; those of a normal variable are 1.6449 and 1.2816
    assert found.median == pytest.approx(21e-3)
    assert found.low == pytest.approx(end(6, -1.6449), rel=1e-4)
    assert found.high == pytest.approx(end(96, 1.6449), rel=1e-4)
    assert found.with_margin == pytest.approx(end(91, 1.2816), rel=1e-4)
    assert found.p90 == pytest.approx(91e-3)


def test_samples_on_one_side_alone_widen_an_interval_to_that_side() -> None:
    errors_m = np.array([1e-3, 2e-3])
    found = figure(errors_m, first, np.ones((RESAMPLED, 2), int), spread=0.1)

    assert found.high / 1e-3 == pytest.approx(math.exp(math.hypot(math.log(2), 0.16449)), rel=1e-4)
    assert 1e-3 / found.low == pytest.approx(math.exp(0.16449), rel=1e-4)


def test_no_error_is_less_than_a_nanometre() -> None:
    found = figure(np.zeros(3), first, np.zeros((RESAMPLED, 3), int), spread=0.0)

    assert (found.median, found.low, found.high) == pytest.approx((1e-9, 1e-9, 1e-9))


@pytest.mark.parametrize(
    ("value", "sampled"), [(math.inf, 3.0), (1.0, math.inf), (1.0, 0.0), (math.inf, math.inf)]
)
def test_an_end_without_a_logarithm_stays_as_it_is(value: float, sampled: float) -> None:
    assert _widened(value, sampled, 1.6449, 0.08) == sampled


def test_a_figure_is_stated_without_its_margin() -> None:
    assert ERROR.to_document() == {"median": 5e-3, "low": 4e-3, "high": 6e-3, "p90": 9e-3}


def test_other_samples_differ_in_how_frequent_kinds_are_by_a_few_percent() -> None:
    count = 128
    picks = resampled(count, 4000, seed=3)
    assert picks.min() >= 0
    assert picks.max() < count
    first = (picks < count // 2).mean(axis=1)
    assert first.mean() == pytest.approx(0.5, abs=0.01)
    assert first.std() == pytest.approx(0.03, rel=0.2)
