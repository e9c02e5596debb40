"""What is around pixels."""

import numpy as np

from transientcam_server.imaging._errors_of_range.neighbours import around, median_around, spread


def test_values_that_are_not_known_spread_nothing() -> None:
    plane = np.array([[1.0, np.nan, 4.0], [np.nan, np.nan, np.nan], [np.inf, np.nan, np.nan]])

    found = spread(around(plane, 3))

    np.testing.assert_array_equal(found, [[0, 3, 0], [0, 3, 0], [np.nan, np.nan, np.nan]])


def test_the_median_around_a_pixel_is_that_of_its_finite_neighbours() -> None:
    random = np.random.default_rng(1)
    plane = random.normal(size=(9, 11)).astype(np.float32)
    plane[random.random(plane.shape) < 0.4] = np.nan
    plane[:, 8:] = np.nan

    found = median_around(plane)

    for y in range(9):
        for x in range(11):
            window = plane[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3]
            ranked = np.sort(window[np.isfinite(window)])
            expected = ranked[(ranked.size - 1) // 2] if ranked.size else 0.0
            assert found[y, x] == expected
