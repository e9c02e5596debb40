"""Motion along straight lines and turns, as a function of the device's time alone."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal

import numpy as np

from transientcam_simulation.scene._geometry import Points, rotation

Repeat = Literal["restart", "back", "loop"]
NOWHERE: Final[Points] = np.zeros((2, 3))


@dataclass(frozen=True, eq=False)
class Motion:
    """Offsets, and turns, visited one after the other, at equal intervals of a period."""

    path_m: Points
    """(N, 3) offsets from the place of what moves."""
    period_s: float
    """Time until it repeats."""
    repeat: Repeat = "restart"
    """How the path's end joins its start: "restart" jumps, "back" goes the way back, "loop" goes on
    straight to the start."""
    rotation_deg: Points = field(default_factory=lambda: NOWHERE)
    """(M, 3) angles by which it is turned about x, then y, then z, before it is offset."""

    @cached_property
    def _knots(self) -> list[Points]:
        """Of offsets and of angles, until all begins again."""
        on = {"back": slice(-2, None, -1), "loop": slice(1)}.get(self.repeat, slice(0))
        return [np.concatenate([path, path[on]]) for path in (self.path_m, self.rotation_deg)]

    def offset_m(self, time_s: float) -> Points:
        """Return the offset at a time of the device."""
        return self._at(time_s, self._knots[0])

    def turn(self, time_s: float) -> Points:
        """Return the matrix (3, 3) of the turn at a time of the device."""
        return rotation(self._at(time_s, self._knots[1]))

    def _at(self, time_s: float, knots: Points) -> Points:
        place = (time_s / self.period_s) % 1.0 * (len(knots) - 1)
        knot = min(int(place), len(knots) - 2)
        before: Points = knots[knot]
        at: Points = before + (place - knot) * (knots[knot + 1] - before)
        return at

    @property
    def speed_m_s(self) -> float:
        """Highest speed on the way."""
        return self._fastest(np.linalg.norm(np.diff(self._knots[0], axis=0), axis=-1))

    @property
    def turn_rad_s(self) -> float:
        """Highest rate of turning: at most the sum of those about the three axes."""
        return self._fastest(np.radians(np.abs(np.diff(self._knots[1], axis=0)).sum(axis=-1)))

    def _fastest(self, steps: Points) -> float:
        return float(steps.max() * len(steps) / self.period_s) if len(steps) else 0.0


STANDS: Final = Motion(NOWHERE, 1e-6)
"""Of what stands before a camera, or in the light of a lamp, that moves."""


def carried(motions: tuple[Motion, ...], time_s: float, centre: Points, points: Points) -> Points:
    """Return where motions take points (N, 3): turned about a centre, one by one, then offset."""
    offset_m: Points = sum((each.offset_m(time_s) for each in motions), centre)
    for each in motions:
        points = centre + (points - centre) @ each.turn(time_s).T
    return points - centre + offset_m


def speed_m_s(motions: tuple[Motion, ...], centre: Points, points: Points) -> float:
    """Return the highest speed of any of some points (N, 3)."""
    radius_m = float(np.linalg.norm(points - centre, axis=-1).max())
    return sum(each.speed_m_s + each.turn_rad_s * radius_m for each in motions)
