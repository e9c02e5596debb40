"""The paper's Fig. 12, on the simulated corner: range by one frequency and by more."""

import pytest

from benchmarks.common.corner import RangeError, range_errors


@pytest.fixture(scope="module")
def errors() -> dict[str, RangeError]:
    return {each.name: each for each in range_errors()}


def test_interreflection_makes_one_frequency_see_the_corner_too_far(
    errors: dict[str, RangeError],
) -> None:
    single = errors["single frequency"]

    assert single.bias_m > 0.05
    assert single.bias_m > 0.9 * single.rms_m  # nearly all of the error is bias


def test_maximum_entropy_takes_most_of_the_error_away(errors: dict[str, RangeError]) -> None:
    single, proposed = errors["single frequency"], errors["maximum entropy, m = 3"]

    assert proposed.rms_m < single.rms_m / 3
    assert proposed.outliers < 0.01


def test_pisarenko_is_right_in_most_pixels_and_far_off_in_some(
    errors: dict[str, RangeError],
) -> None:
    """ "The Pisarenko estimate suffers from severe outliers" (Sec. 6.2)."""
    sparse, proposed = errors["Pisarenko, m = 4"], errors["maximum entropy, m = 4"]

    assert sparse.median_m < 0.03
    assert sparse.outliers > proposed.outliers + 0.01


def test_without_interreflection_one_frequency_is_right() -> None:
    single = range_errors("sim:corner?interreflection=off")[0]

    assert single.rms_m < 0.005
