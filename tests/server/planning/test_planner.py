"""What a planner says of ranges whose truth is known."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from transientcam_server.planning._planner import range_error


def errors(found_m: list[float], true_m: list[float]) -> dict[str, float] | None:
    found, truth = (
        cast(Any, SimpleNamespace(range_m=np.array(each))) for each in (found_m, true_m)
    )
    return range_error(found, truth)


def test_pixels_with_a_range_and_a_truth_count() -> None:
    none = np.nan

    assert errors([1.3, 2.6, none, 3.0, 9.0], [1.0, 3.0, 5.0, none, 9.0]) == pytest.approx(
        {"median": 0.3, "rms": np.sqrt((0.3**2 + 0.4**2) / 3)}
    )
    assert errors([none, 1.0], [1.0, none]) is None
