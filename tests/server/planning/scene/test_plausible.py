"""Ranges that moments do not contradict."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_server.planning._scene.description import dim_share
from transientcam_server.planning._scene.plausible import plausible_ranges

BASE_HZ = 11.5e6
HARMONICS = 12
NOISE = 2e-3
PIXELS = 40
Looked = tuple[NDArray[Any], NDArray[Any]]


def looked(delays_ns: list[float], weights: list[float], decay_ns: float = 0.0) -> Looked:
    """Noisy moments of returns that all go on for so long, with their variance."""
    j = np.arange(HARMONICS + 1)[:, None]
    omega = 2 * np.pi * BASE_HZ * j
    b = sum(w * np.exp(1j * omega * d * 1e-9) for d, w in zip(delays_ns, weights, strict=True))
    b = np.repeat(b / (1 - 1j * omega * decay_ns * 1e-9), PIXELS, axis=1)
    random = np.random.default_rng(5)
    noise = random.normal(size=(*b.shape, 2)) @ [1, 1j]
    return b + NOISE * noise, np.full(b.shape, NOISE**2)


def bounds(moments: Looked, direct_m: float, uncertainty_m: float = 0.0) -> Looked:
    full = np.full(PIXELS, direct_m), np.full(PIXELS, uncertainty_m)
    return plausible_ranges(*moments, BASE_HZ, *full)


def range_m(delay_ns: float) -> float:
    return tm.SPEED_OF_LIGHT_M_S / 2 * delay_ns * 1e-9


def test_a_single_return_is_where_it_seems() -> None:
    direct_m = range_m(13.0)
    earliest_m, latest_m = bounds(looked([13.0], [1.0]), direct_m)
    assert np.mean((earliest_m == direct_m) & (latest_m == direct_m)) > 0.95


@pytest.mark.parametrize("decay_ns", [0.4, 0.8, 1.2])
def test_light_out_of_a_material_may_begin_where_it_does(decay_ns: float) -> None:
    # where the estimate lies is not known: as late as light comes back on average
    moments = looked([13.0], [1.0], decay_ns)
    earliest_m, latest_m = bounds(moments, range_m(13.0 + decay_ns))
    true_m = range_m(13.0)
    near_m = range_m(0.1 * decay_ns)  # delays are on a grid
    assert np.mean((earliest_m <= true_m + near_m) & (latest_m >= true_m)) > 0.75


def test_returns_far_apart_are_no_tail() -> None:
    direct_m = range_m(13.0)
    earliest_m, latest_m = bounds(looked([13.0, 22.0], [0.6, 0.4]), direct_m, 2e-3)
    assert earliest_m == pytest.approx(direct_m)
    assert latest_m == pytest.approx(direct_m + 2e-3)


def test_what_few_frequencies_show_anything_explains() -> None:
    b, variance = looked([13.0, 13.7], [0.6, 0.4])
    earliest_m, latest_m = plausible_ranges(
        b[:3], variance[:3], BASE_HZ, np.full(PIXELS, 2.0), np.full(PIXELS, 0.1)
    )
    assert earliest_m == pytest.approx(2.0)
    assert latest_m == pytest.approx(2.1)


def test_pixels_with_hardly_any_light_for_their_range_are_dim() -> None:
    range_of_pixels_m = np.array([1.0, 1.0, 2.0, 2.0])
    direct = np.array([1.0, 0.9, 0.25, 0.2])
    assert dim_share(direct, range_of_pixels_m) == 0.0
    assert dim_share(direct * [1, 1, 1, 0.1], range_of_pixels_m) == 0.25
