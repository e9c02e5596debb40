"""What a calibration is off at another temperature than that which it was measured at."""

from dataclasses import dataclass
from typing import Final

NOTABLE_C: Final = 5.0
DRIFT_M_PER_C: Final = 1.5e-3
"""By how much the range may drift for each degree, where nothing else is known: 10 ps of delay, as
of a board without compensation; the simulated prototype has 4 ps."""


@dataclass(frozen=True, slots=True)
class TemperatureDrift:
    """How much warmer a camera is than it was when it was calibrated.

    ``calibrated_c``, ``now_c``: both temperatures of the sensor.
    """

    calibrated_c: float
    now_c: float

    @classmethod
    def between(cls, calibrated_c: float | None, now_c: float | None) -> "TemperatureDrift | None":
        """Return it; None where one of both temperatures is not known."""
        return None if calibrated_c is None or now_c is None else cls(calibrated_c, now_c)

    @property
    def range_m(self) -> float:
        """By how much the range may be off, without a sign."""
        return DRIFT_M_PER_C * abs(self.now_c - self.calibrated_c)

    @property
    def warning(self) -> str | None:
        """What to say of it; None where it is small."""
        if abs(self.now_c - self.calibrated_c) < NOTABLE_C:
            return None
        return (
            f"it was measured at {self.calibrated_c:.1f} degrees Celsius, and the temperature "
            f"is {self.now_c:.1f} now: ranges may be off by {1e3 * self.range_m:.0f} mm"
        )
