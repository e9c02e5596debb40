"""Synthetic frames of a Kinect v2, and what libfreenect2 makes of them."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

Scene = dict[str, NDArray[Any]]
Load = Callable[[str], Scene]


@pytest.fixture(scope="session")
def vectors(data_dir: Path) -> Load:
    """Return the arrays of a scene by its name: ramp, two_returns, noisy, tables or stream."""

    @cache
    def load(name: str) -> Scene:
        with np.load(data_dir / "kinect2" / f"{name}.npz") as stored:
            return dict(stored)

    return load
