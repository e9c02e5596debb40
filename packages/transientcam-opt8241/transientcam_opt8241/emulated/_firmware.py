"""The registers of an emulated OPT8241-CDK: what is written, and what follows from it."""

from typing import Final

from transientcam_driver.errors import TransferStalled
from transientcam_opt8241 import (
    CLOCK_HZ,
    REGISTER_BYTES,
    Field,
    PllSetting,
    Request,
    _registers as reg,
)

LEAST_QUAD_CLOCKS: Final = 50_000
MOST_DUTY: Final = 20
"""Limits of the evaluation kit."""
_READ_ONLY: Final = frozenset({0x01, 0x61, 0x62, 0x63})
_LENGTHS: Final[dict[int, int]] = {
    Request.WRITE_REGISTER: REGISTER_BYTES,
    Request.WRITE_MONITOR: 2,
    Request.WRITE_SUPPLY: 1,
}
_LIMITED: Final = (
    (reg.PIX_CNT_MAX, reg.PIX_CNT_MAX_SET_FAILED, range(LEAST_QUAD_CLOCKS, 1 << 22)),
    (reg.INTG_DUTY_CYCLE, reg.INTG_DUTY_CYCLE_SET_FAILED, range(MOST_DUTY + 1)),
)


class EmulatedRegisters:
    """Registers, at their defaults after power-up; those that no field is in are kept as written.

    ``modulation_hz``: frequency of the light: new fields of the PLL take effect when
    `registers.MOD_PLL_UPDATE` goes from 1 to 0.
    """

    def __init__(self) -> None:
        self._reset()

    # --- requests ----------------------------------------------------------------------------

    def read(self, request: int, value: int, index: int, length: int) -> bytes:
        """Answer a request. Raises TransferStalled where there is no such request."""
        if request != Request.READ_REGISTER or value not in (reg.BANK_0, reg.BANK_3):
            raise TransferStalled
        return self._words.get((value, index), 0).to_bytes(REGISTER_BYTES, "little")[:length]

    def write(self, request: int, value: int, index: int, data: bytes) -> None:
        """Take a request; supplies and monitors are accepted without effect.

        Raises TransferStalled where there is no such request, or it has another length.
        """
        if len(data) != _LENGTHS.get(request):
            raise TransferStalled
        if request == Request.WRITE_REGISTER:
            self._write(value, index, int.from_bytes(data, "little"))

    # --- what follows ------------------------------------------------------------------------

    def __getitem__(self, field: Field) -> int:
        """Return the value of a field."""
        return field.of(self._words[field.place])

    @property
    def running(self) -> bool:
        """Whether the sensor exposes; then its light is on."""
        return not self[reg.TG_DIS]

    @property
    def quads(self) -> int:
        """Phases of a frame."""
        return self[reg.QUAD_CNT_MAX]

    @property
    def exposure_s(self) -> float:
        """How long the light is on in a quad."""
        return self[reg.PIX_CNT_MAX] / CLOCK_HZ * self[reg.INTG_DUTY_CYCLE] / 64

    @property
    def frame_s(self) -> float:
        """From one frame to the next."""
        return self[reg.PIX_CNT_MAX] / CLOCK_HZ * self.quads * self[reg.SUB_FRAME_CNT_MAX]

    @property
    def gives_raw_quads(self) -> bool:
        """Whether frames are raw quads of all pixels, the only ones that are emulated."""
        whole = self[reg.BIN_ROW_COUNT], self[reg.BIN_COL_COUNT], self[reg.BLK_HEADER_EN]
        return self[reg.OUTPUT_MODE] == reg.RAW_QUADS and whole == (240, 320, 0)

    def set_temperature(self, sensor_c: float) -> None:
        """Set what the thermometer of the sensor shows."""
        self._put(reg.TSENSOR, round(sensor_c) & 0xFF)

    # --- inside ------------------------------------------------------------------------------

    def _reset(self) -> None:
        self._words = dict.fromkeys((each.place for each in reg.all_fields()), 0)
        for field in reg.all_fields():
            self._put(field, field.default)
        self._apply_pll()

    def _put(self, field: Field, value: int) -> None:
        self._words[field.place] = field.put(self._words[field.place], value)

    def _apply_pll(self) -> None:
        pll = PllSetting(self[reg.MOD_M1], self[reg.MOD_M_FRAC1], self[reg.MOD_PS1])
        self.modulation_hz = pll.frequency_hz(self.quads, self[reg.MOD_N1])

    def _write(self, slave: int, register: int, word: int) -> None:
        if slave == reg.BANK_3 and register in _READ_ONLY:
            return
        before = self._words.get((slave, register), 0)
        for field, failed, allowed in _LIMITED:
            if field.place == (slave, register):
                refused = field.of(word) not in allowed
                self._put(failed, refused)
                word = field.put(word, field.of(before)) if refused else word
        self._words[slave, register] = word
        if self[reg.SOFTWARE_RESET]:
            self._reset()
        updated = reg.MOD_PLL_UPDATE
        if updated.place == (slave, register) and updated.of(before) > updated.of(word):
            self._apply_pll()
