"""The estimators that are planned with."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from transientcam_server.imaging.ranging import ranges_m
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
SEARCHED: Final = ("single-frequency", "maximum-entropy", "likelihood")
"""Estimators that are planned with where none is named. On no scene was Pisarenko's the best."""
ESTIMATORS: Final = (*SEARCHED, "pisarenko")
"""All that can be predicted."""
MOST_HARMONICS: Final[Mapping[str, int]] = MappingProxyType({"single-frequency": 1})
"""More harmonics than these do nothing for an estimator."""


def smooth_and_sharp(
    b: _Array, variance: _Array, base_frequency_hz: float, settings: ReconstructionSettings
) -> tuple[_Array, _Array]:
    """Return ranges (P) by maximum entropy, and by the likelihood of few returns.

    Where only one of them gives a range, both are that.
    """
    smooth_m, sharp_m = (
        ranges_m(b, variance, name, base_frequency_hz, settings)
        for name in ("maximum-entropy", "likelihood")
    )
    smooth_m = np.where(np.isfinite(smooth_m), smooth_m, sharp_m)
    return smooth_m, np.where(np.isfinite(sharp_m), sharp_m, smooth_m)
