"""What a planner says of ranges whose truth is known."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from transientcam_server.planning._planner import range_error


def errors(
    found_m: list[float], true_m: list[float], unlit: tuple[int, ...] = ()
) -> dict[str, float] | None:
    lit = np.isfinite(true_m)
    lit[list(unlit)] = False
    found = cast(Any, SimpleNamespace(range_m=np.array(found_m)))
    return range_error(found, cast(Any, SimpleNamespace(range_m=np.array(true_m), lit=lit)))


def test_pixels_with_a_range_and_direct_light_count() -> None:
    none = np.nan

    found = errors([1.3, 2.6, none, 3.0, 9.0, 9.0], [1.0, 3.0, 5.0, none, 9.0, 1.0], unlit=(5,))

    assert found == pytest.approx(
        {"median": 0.3, "rms": np.sqrt((0.3**2 + 0.4**2) / 3), "no_direct_light_share": 1 / 6}
    )
    assert errors([none, 1.0], [1.0, none]) is None
