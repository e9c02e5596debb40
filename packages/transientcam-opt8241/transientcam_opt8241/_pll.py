"""The PLL that makes the modulation frequency.

`TI3DToF/ToFTintinCamera.cpp` of 3dtof/voxelsdk @ db85629: VCO = 2 x 48 MHz (M + frac / 65536) / 2^N
from 300 to 600 MHz, and f = VCO / (quads (1 + ps)).
"""

from dataclasses import dataclass
from typing import Final

CLOCK_HZ: Final = 48e6
DIVIDER: Final = 2
"""N. The description of the register and the SDK's formula disagree for others."""
LEAST_VCO_HZ: Final = 300e6
MOST_VCO_HZ: Final = 600e6
FRACTIONS: Final = 1 << 16


@dataclass(frozen=True, slots=True)
class PllSetting:
    """What stands in the registers: M, its fraction in 1 / 65536, and the post divider less 1."""

    m: int
    fraction: int
    post_divider: int

    @classmethod
    def of(cls, frequency_hz: float, quads: int) -> "PllSetting":
        """Return the setting for a frequency: the SDK's choice, the fraction cut off."""
        post_divider = int(LEAST_VCO_HZ // (quads * frequency_hz))
        ratio = (post_divider + 1) * quads * frequency_hz * (1 << DIVIDER) / (2 * CLOCK_HZ)
        return cls(int(ratio), int(ratio % 1 * FRACTIONS), post_divider)

    def frequency_hz(self, quads: int, divider: int = DIVIDER) -> float:
        """Return the frequency that it makes."""
        vco_hz = 2 * CLOCK_HZ * (self.m + self.fraction / FRACTIONS) / (1 << divider)
        return vco_hz / (quads * (1 + self.post_divider))
