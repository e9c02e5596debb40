"""Times of captures, under clocks that are set."""

import numpy as np
import pytest

from transientcam_driver.camera import CaptureClock, capture_times

DEVICE_S = 5.0 + 0.1 * np.arange(12)
CAPTURE_S = np.full(12, 0.09)
DELAY_S = np.array([0.12, 0.03, 0.004, *[0.02] * 9])
"""From the last read-out to the arrival."""
BEGUN_S = 1.8e9 + DEVICE_S
STEPPED_S = np.repeat([0.0, 7200.0, -7200.0], 4)


def live(device_s: np.ndarray, host_s: np.ndarray) -> np.ndarray:
    clock = CaptureClock()
    rows = zip(device_s.tolist(), host_s.tolist(), strict=True)
    return np.array([clock.unix_s(device_time_s=d, capture_s=0.09, host_time_s=h) for d, h in rows])


def test_recorded_times_keep_the_devices_intervals_under_any_step_of_the_hosts_clock() -> None:
    found = capture_times(DEVICE_S, CAPTURE_S, BEGUN_S + CAPTURE_S + DELAY_S + STEPPED_S)

    np.testing.assert_allclose(found, BEGUN_S + 0.004, atol=1e-6)


def test_live_times_come_close_with_the_first_frames_and_stay_there() -> None:
    found = live(DEVICE_S, BEGUN_S + CAPTURE_S + DELAY_S + STEPPED_S)

    np.testing.assert_allclose(found[2:], BEGUN_S[2:] + 0.004, atol=1e-6)
    assert (np.diff(found) > 0).all()


@pytest.mark.parametrize("step_s", [0.0, -3600.0])
def test_times_go_on_growing_where_the_device_begins_anew(step_s: float) -> None:
    device_s = np.concatenate([DEVICE_S[:6], DEVICE_S[:6]])
    host_s = BEGUN_S + CAPTURE_S + np.repeat([0.0, step_s], 6)

    for found in (live(device_s, host_s), capture_times(device_s, CAPTURE_S, host_s)):
        assert (np.diff(found) > 0).all()
        np.testing.assert_allclose(np.diff(found)[6:], 0.1, atol=1e-6)


@pytest.mark.parametrize("drift", [-1e-4, 1e-4])
def test_live_times_follow_a_device_whose_clock_runs_apart_from_the_hosts(drift: float) -> None:
    true_s = 0.5 * np.arange(7200)  # an hour
    device_s = 5.0 + true_s * (1.0 + drift)
    delay_s = np.random.default_rng(1).exponential(0.01, len(true_s))

    found = live(np.array(device_s), 1.8e9 + true_s + 0.09 + delay_s)

    late_s = found - 1.8e9 - true_s
    assert abs(late_s[-600:]).max() < 0.01
    np.testing.assert_allclose(np.diff(found)[30:], np.diff(device_s)[30:], rtol=3e-3)


@pytest.mark.parametrize("absurd_s", [np.nan, np.inf, -1.7e308, 1.7e308])
@pytest.mark.parametrize("which", [0, 1, 2])
@pytest.mark.parametrize("at", [0, 5, 11])
def test_times_that_are_none_cost_no_other_frame_its_time(
    at: int, which: int, absurd_s: float
) -> None:
    stated_s = [DEVICE_S.copy(), CAPTURE_S.copy(), BEGUN_S + CAPTURE_S]
    stated_s[which][at] = absurd_s

    found = capture_times(*stated_s)

    others = np.arange(len(found)) != at
    np.testing.assert_allclose(found[others], BEGUN_S[others], atol=1e-6)
    assert (np.diff(found) >= 0).all()


def test_frames_that_all_state_no_time_are_read_all_the_same() -> None:
    assert np.isfinite(capture_times(np.full(3, np.inf), np.zeros(3), np.full(3, np.nan))).all()
