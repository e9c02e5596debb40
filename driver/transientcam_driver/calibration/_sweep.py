"""The phase sweep of a calibration: the same images at phases between the four.

`transientcam_moments.sweep_phasors` and `waveform_of` evaluate it.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.sequence import Sequence

SWEEP_STEPS = 16
"""Phase offsets of a sweep, a quarter of a turn in all: 64 phases."""
LEAST_TAKES = 30
"""A calibration with fewer has no sweep: its steps would have too few takes to find outliers."""
_TAKES_SHARE = 10  # of the takes of a calibration, each step of the sweep has one in so many

Waveform = Callable[[Iterator[NDArray[np.uint16]]], NDArray[Any] | None]
"""From the takes (takes, 4 m, H, W) at each step to the harmonics (m, K) relative to the
fundamental, complex; None where they cannot be determined."""


@dataclass(frozen=True, slots=True)
class PhaseSweep:
    """What a phase sweep captures besides a calibration of so many takes."""

    takes: int

    @classmethod
    def beside(cls, takes: int) -> "PhaseSweep | None":
        """Return the sweep of a calibration with so many takes; None for fewer than LEAST_TAKES."""
        return None if takes < LEAST_TAKES else cls(takes // _TAKES_SHARE)

    @property
    def frames(self) -> int:
        """How many frames it captures."""
        return SWEEP_STEPS * self.takes

    def sequences(self, single: Sequence) -> Iterator[Sequence]:
        """Return the sequence of each step, of one that captures a single take."""
        for step in range(SWEEP_STEPS):
            offset_rad = step * math.pi / (2 * SWEEP_STEPS)
            yield replace(single, phase_offset_rad=offset_rad)
