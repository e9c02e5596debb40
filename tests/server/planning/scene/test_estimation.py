"""The range that a scene is planned for, of two that err in opposite ways."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_server.planning._scene import estimation
from transientcam_server.settings import ReconstructionSettings


def test_of_two_ranges_the_shorter_holds_and_their_distance_is_the_doubt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    none = np.nan
    ranges = {
        "maximum-entropy": np.array([2.0, 2.5, 2.0, none, 3.0, none]),
        "likelihood": np.array([2.5, 2.0, 2.0, 3.0, none, none]),
    }

    def ranges_m(_b: object, _variance: object, estimator: str, *_: object) -> NDArray[Any]:
        return ranges[estimator]

    monkeypatch.setattr(estimation, "ranges_m", ranges_m)
    moments = np.ones((3, 6))

    range_m, doubt_m = estimation.direct_range(moments, moments, 1e7, ReconstructionSettings())

    assert range_m == pytest.approx([2, 2, 2, 3, 3, none], nan_ok=True)
    assert doubt_m == pytest.approx([0.5, 0.5, 0, 0, 0, none], nan_ok=True)


def test_a_single_return_is_where_it_is_beyond_doubt() -> None:
    base_hz, true_m = 10e6, np.array([0.8, 3.1, 9.7])
    phase_rad = 4 * np.pi * base_hz * true_m / 299_792_458
    b = 1000 * np.exp(1j * np.arange(4)[:, None] * phase_rad)

    range_m, doubt_m = estimation.direct_range(
        b, np.full(b.shape, 1e-4), base_hz, ReconstructionSettings()
    )

    assert range_m == pytest.approx(true_m, abs=1e-3)
    assert doubt_m == pytest.approx(0, abs=1e-3)


def test_one_frequency_is_never_planned_with_more_harmonics() -> None:
    assert estimation.MOST_HARMONICS == {"single-frequency": 1}
