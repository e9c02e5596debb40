"""Intervals of predicted errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from transientcam_server.planning.intervals import (
    MOST_BIAS,
    RESAMPLED,
    Figure,
    figure,
    with_unknown_bias,
)

ERROR = Figure(median=5e-3, low=4e-3, high=6e-3, p90=9e-3, with_margin=5.3e-3)
LENGTHS_M = st.floats(1e-6, 1.0)


def test_an_error_that_is_all_noise_keeps_its_interval() -> None:
    assert with_unknown_bias(ERROR, std_m=5e-3, bias_m=0.0) == ERROR


def test_an_error_that_is_all_bias_is_as_uncertain_as_biases_are() -> None:
    found = with_unknown_bias(ERROR, std_m=0.0, bias_m=5e-3)
    assert found.low == 0.0
    assert found.high == pytest.approx(MOST_BIAS * 6e-3)


@given(LENGTHS_M, LENGTHS_M)
def test_other_biases_widen_an_interval_and_change_no_target(std_m: float, bias_m: float) -> None:
    found = with_unknown_bias(ERROR, std_m, bias_m)
    assert found.low <= ERROR.low * (1 + 1e-12)
    assert found.high >= ERROR.high * (1 - 1e-12)
    assert (found.median, found.with_margin, found.p90) == (5e-3, 5.3e-3, 9e-3)


def test_an_error_without_bound_is_left_as_it_is() -> None:
    assert with_unknown_bias(ERROR, math.inf, 1e-3) == ERROR


def test_a_figure_of_equal_pixels_is_as_wide_as_the_model_is_uncertain() -> None:
    # 8 % of spread, and the 95 % quantile of a normal variable: 1.6449 deviations
    errors_m, picks = np.full(50, 2e-3), np.zeros((RESAMPLED, 50), int)
    found = figure(errors_m, lambda each: float(np.median(each)), picks)
    assert found.median == found.p90 == pytest.approx(2e-3)
    assert found.high / found.median == pytest.approx(math.exp(1.6449 * 0.08), rel=1e-4)
    assert found.median / found.low == pytest.approx(math.exp(1.6449 * 0.08), rel=1e-4)


def test_fewer_pixels_widen_a_figure() -> None:
    random = np.random.default_rng(0)

    def width(count: int) -> float:
        errors_m = np.exp(np.random.default_rng(1).normal(size=count))
        picks = random.integers(0, count, (RESAMPLED, count))
        found = figure(errors_m, lambda each: float(np.median(each)), picks)
        return found.high / found.low

    assert width(10) > width(1000)
