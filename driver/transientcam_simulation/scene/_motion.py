"""Motion of surfaces along straight lines, as a function of the device's time alone."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from transientcam_simulation.scene._geometry import Points

Repeat = Literal["restart", "back", "loop"]


@dataclass(frozen=True, eq=False)
class Motion:
    """Offsets visited one after the other, at equal intervals of a period."""

    path_m: Points
    """(N, 3) offsets from the surface's place."""
    period_s: float
    """Time until it repeats."""
    repeat: Repeat = "restart"
    """How the path's end joins its start: "restart" jumps, "back" goes the way back, "loop" goes on
    straight to the start."""

    @cached_property
    def _knots_m(self) -> Points:
        if self.repeat == "back":
            return np.concatenate([self.path_m, self.path_m[-2::-1]])
        if self.repeat == "loop":
            return np.concatenate([self.path_m, self.path_m[:1]])
        return self.path_m

    def offset_m(self, time_s: float) -> Points:
        """Return the offset at a time of the device."""
        knots_m = self._knots_m
        place = (time_s / self.period_s) % 1.0 * (len(knots_m) - 1)
        knot = min(int(place), len(knots_m) - 2)
        before: Points = knots_m[knot]
        offset: Points = before + (place - knot) * (knots_m[knot + 1] - before)
        return offset

    @property
    def speed_m_s(self) -> float:
        """Highest speed on the way."""
        steps_m = np.linalg.norm(np.diff(self._knots_m, axis=0), axis=-1)
        return float(steps_m.max() * len(steps_m) / self.period_s) if len(steps_m) else 0.0
