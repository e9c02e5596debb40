"""Moments of three returns a pixel, as a scene might have them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def moments(m: int, pixels: int = 12) -> Array:
    random = np.random.default_rng(m)
    phase = random.uniform(0.3, 6.0, (3, pixels))
    weight = random.uniform(100, 500, (3, pixels))
    b = (weight * np.exp(1j * np.arange(m + 1)[:, None, None] * phase)).sum(axis=1)
    b[0] += 20.0
    return np.asarray(b)
