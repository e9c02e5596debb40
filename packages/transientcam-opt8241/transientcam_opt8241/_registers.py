"""The registers of the controller OPT9221 that are used here: 24 bits each.

Places and defaults are read in `TI3DToF/OPT9221.dml` of 3dtof/voxelsdk @ db85629.
"""

from dataclasses import dataclass
from typing import Final

BANK_0, BANK_3 = 0x58, 0x5C
REGISTER_BYTES: Final = 3


@dataclass(frozen=True, slots=True)
class Field:
    """Some bits of a register."""

    slave: int
    register: int
    """``slave``, ``register``: where it is."""
    high: int
    low: int
    """``high``, ``low``: its first and its last bit, the highest one first."""
    default: int = 0
    """Its value after a reset."""
    signed: bool = False
    """Whether it is a two's complement."""

    @property
    def place(self) -> tuple[int, int]:
        """Slave and register."""
        return self.slave, self.register

    @property
    def _mask(self) -> int:
        return (1 << (self.high - self.low + 1)) - 1

    def of(self, word: int) -> int:
        """Return its value in the word of its register."""
        value = word >> self.low & self._mask
        return value - self._mask - 1 if self.signed and value > self._mask >> 1 else value

    def put(self, word: int, value: int) -> int:
        """Return a word with another value in its place.

        Raises ValueError where it has not so many bits.
        """
        if value != value & self._mask:
            raise ValueError(f"{value} in {self.high - self.low + 1} bits")
        return word & ~(self._mask << self.low) | value << self.low


SOFTWARE_RESET: Final = Field(BANK_3, 0x00, 0, 0)
MINOR: Final = Field(BANK_3, 0x01, 4, 0, 17)
MAJOR: Final = Field(BANK_3, 0x01, 7, 5)
TG_DIS: Final = Field(BANK_0, 0x80, 0, 0, 1)
"""1: the sensor is stopped, and its light off."""
MOD_PLL_UPDATE: Final = Field(BANK_0, 0x02, 2, 2)
"""1, then 0: the fields of the PLL take effect."""
MOD_M1: Final = Field(BANK_0, 0x0C, 21, 16, 16)
MOD_M_FRAC1: Final = Field(BANK_0, 0x0C, 15, 0)
MOD_N1: Final = Field(BANK_0, 0x0F, 1, 0, 2)
MOD_PS1: Final = Field(BANK_0, 0x0F, 6, 4, 1)
SSCG_EN: Final = Field(BANK_0, 0x0E, 3, 3)
QUAD_HOP_EN: Final = Field(BANK_0, 0x12, 7, 7)
PIX_CNT_MAX: Final = Field(BANK_0, 0x82, 21, 0, 100_000)
"""Length of a quad in clocks of 48 MHz."""
QUAD_CNT_MAX: Final = Field(BANK_0, 0x83, 3, 0, 4)
SUB_FRAME_CNT_MAX: Final = Field(BANK_0, 0x83, 7, 4, 4)
DEALIAS_EN: Final = Field(BANK_3, 0x02, 23, 23)
OUTPUT_MODE: Final = Field(BANK_3, 0x25, 11, 8)
ROWS_TO_MERGE: Final = Field(BANK_3, 0x2F, 9, 0, 1)
BINNING_EN: Final = Field(BANK_3, 0x2F, 12, 12)
BIN_ROW_COUNT: Final = Field(BANK_3, 0x2F, 23, 14, 240)
COLS_TO_MERGE: Final = Field(BANK_3, 0x30, 9, 0, 1)
BIN_COL_COUNT: Final = Field(BANK_3, 0x30, 23, 14, 320)
PHY_TEST_ENABLE: Final = Field(BANK_3, 0x29, 1, 1)
AMPLITUDE_THRESHOLD: Final = Field(BANK_3, 0x36, 11, 0)
OP_CLK_FREQ: Final = Field(BANK_3, 0x39, 2, 1)
DEBUG_FRAME_NUMBER_EN: Final = Field(BANK_3, 0x39, 12, 12)
BLK_SIZE: Final = Field(BANK_3, 0x3C, 23, 4, 1024)
BLK_HEADER_EN: Final = Field(BANK_3, 0x3C, 2, 2)
FB_READY_EN: Final = Field(BANK_3, 0x3F, 0, 0, 1)
OP_CS_POL: Final = Field(BANK_3, 0x40, 14, 14)
INTG_DUTY_CYCLE: Final = Field(BANK_3, 0x4C, 5, 0, 6)
"""The light is on for so many 64ths of a quad."""
NORMAL_FRM_INTG_SCALE: Final = Field(BANK_3, 0x4D, 8, 6)
TSENSOR: Final = Field(BANK_3, 0x61, 7, 0, 35, signed=True)
TILLUM: Final = Field(BANK_3, 0x62, 7, 0, 40, signed=True)
PIX_CNT_MAX_SET_FAILED: Final = Field(BANK_3, 0x63, 22, 22)
INTG_DUTY_CYCLE_SET_FAILED: Final = Field(BANK_3, 0x63, 23, 23)
DELAY_FB_COEFF_1: Final = Field(BANK_3, 0xB3, 11, 0, 2048)
FILT_EN: Final = Field(BANK_3, 0xB6, 19, 19)
# what they mean is not known; the profiles of the SDK set them
INIT_2: Final = Field(BANK_0, 0xBD, 21, 0)
INIT_3: Final = Field(BANK_0, 0xBE, 21, 0)
INIT_4: Final = Field(BANK_0, 0xBD, 22, 22)
INIT_5: Final = Field(BANK_0, 0xBF, 23, 22)

RAW_QUADS: Final = 15
"""Of `OUTPUT_MODE`: quads as they were sampled."""


def all_fields() -> tuple[Field, ...]:
    """Return every field of this module."""
    return tuple(each for each in globals().values() if isinstance(each, Field))
