"""The sensor: from electrons to digital numbers."""

from dataclasses import dataclass, replace

IDEAL_BITS = 16


@dataclass(frozen=True, slots=True)
class Sensor:
    """A pixel and its converter; one for all pixels.

    ``full_well_e``: electrons a pixel holds.
    ``gain_e_per_dn``: electrons a digital number stands for.
    ``read_noise_e``: standard deviation of the read-out, in electrons.
    ``dark_dn``: what the converter gives for an empty pixel: room for the read noise below zero.
    ``bits``: of the converter; its highest code means saturation.
    """

    full_well_e: float = 40_000.0
    gain_e_per_dn: float = 9.0
    read_noise_e: float = 30.0
    dark_dn: float = 64.0
    bits: int = 12

    @property
    def highest_dn(self) -> int:
        """The highest code: a saturated pixel."""
        return (1 << self.bits) - 1

    def ideal(self) -> "Sensor":
        """Return the same pixel, read without noise by a 16-bit converter over the same range."""
        finer = 1 << (IDEAL_BITS - self.bits)
        return replace(
            self,
            bits=IDEAL_BITS,
            gain_e_per_dn=self.gain_e_per_dn / finer,
            dark_dn=self.dark_dn * finer,
            read_noise_e=0.0,
        )
