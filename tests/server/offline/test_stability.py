"""Allan deviations of ranges: against closed forms, and the sum by its definition."""

import numpy as np
import pytest

from transientcam_server.errors import InputError
from transientcam_server.offline import stability

TIMES_S = [0.05 * k for k in range(256)]


def test_noise_falls_with_the_root_of_the_averaging_time() -> None:
    ranges_m = 2.0 + np.random.default_rng(0).normal(0.0, 0.01, (256, 4000))

    found = stability(zip(TIMES_S, ranges_m, strict=True))

    counts = np.array(found["averaging_s"]) / 0.05
    np.testing.assert_allclose(found["median_m"], 0.01 / np.sqrt(counts), rtol=0.1)
    np.testing.assert_allclose(found["noise_alone_m"], 0.01 / np.sqrt(counts), rtol=0.02)
    assert (found["frames"], found["pixels"], found["best_frames"]) == (256, 4000, 32)
    assert found["longer_may_help"]


def test_drift_bends_it_up_and_the_best_time_is_where_both_meet() -> None:
    noise_m, drift_m = 0.01, 2e-4  # of a frame, and from each to the next
    random = np.random.default_rng(1)
    ranges_m = random.normal(0.0, noise_m, (256, 4000)) + drift_m * np.arange(256)[:, None]

    found = stability(zip(TIMES_S, ranges_m, strict=True))

    # the deviation of noise, and that of a straight line, n d / sqrt 2
    counts = np.round(np.array(found["averaging_s"]) / 0.05)
    expected = np.hypot(noise_m / np.sqrt(counts), counts * drift_m / np.sqrt(2))
    np.testing.assert_allclose(found["median_m"], expected, rtol=0.1)
    best = (noise_m / drift_m) ** (2 / 3)  # of their sum of squares, by its derivative
    assert found["best_frames"] == pytest.approx(best, rel=0.35)
    assert not found["longer_may_help"]


def test_it_is_the_sum_of_its_definition_over_pixels_that_have_a_range() -> None:
    ranges_m = np.random.default_rng(2).normal(size=(32, 3))
    ranges_m[5, 1] = np.nan

    found = stability(zip(TIMES_S[:32], ranges_m, strict=True))

    for n, median_m in zip((1, 2, 3, 4), found["median_m"], strict=True):
        each = []
        for pixel in ranges_m[:, [0, 2]].T:
            pairs = [
                np.mean(pixel[k + n : k + 2 * n]) - np.mean(pixel[k : k + n])
                for k in range(32 - 2 * n + 1)
            ]
            each.append(np.sqrt(np.mean(np.square(pairs)) / 2))
        assert median_m == pytest.approx(np.median(each))


@pytest.mark.parametrize("ranges_m", [np.ones((15, 5)), np.full((17, 5), np.nan)])
def test_what_tells_nothing_is_refused(ranges_m: np.ndarray) -> None:
    with pytest.raises(InputError, match="16 frames, and a pixel"):
        stability(zip(TIMES_S[: len(ranges_m)], ranges_m, strict=True))
