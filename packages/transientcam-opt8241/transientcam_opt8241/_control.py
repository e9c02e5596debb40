"""Registers over a link: fields that share a register are written together."""

import threading
from collections.abc import Mapping
from typing import Final

from transientcam_driver.errors import ProtocolError
from transientcam_opt8241._link import Link, Request
from transientcam_opt8241._registers import REGISTER_BYTES, Field

LIGHT_DRIVER: Final = 0x54
"""Potentiometers of the light driver."""
MONITORS: Final = (0x4B, 0x4E)
"""Current monitors of the board and of the light."""


class Control:
    """Reads and writes what a camera is set to; for several threads."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._lock = threading.Lock()
        self._words: dict[tuple[int, int], int] = {}

    def get(self, field: Field) -> int:
        """Read a field from the camera.

        Raises CameraError where the camera does not answer, or the answer has another length.
        """
        with self._lock:
            return field.of(self._read(field))

    def set(self, values: Mapping[Field, int]) -> None:
        """Write fields, one register after the other; the other bits of each stay.

        Raises CameraError as `get`.
        """
        with self._lock:
            words: dict[tuple[int, int], int] = {}
            for field, value in values.items():
                before = words.get(field.place, self._words.get(field.place))
                words[field.place] = field.put(
                    self._read(field) if before is None else before, value
                )
            for (slave, register), word in words.items():
                self._words.pop((slave, register), None)  # not known, where this fails
                data = word.to_bytes(REGISTER_BYTES, "little")
                self._link.control_out(Request.WRITE_REGISTER, slave, register, data)
                self._words[slave, register] = word

    def written(self, field: Field) -> bytes:
        """Return the bytes that the register of a field was last written with."""
        with self._lock:
            return self._words[field.place].to_bytes(REGISTER_BYTES, "little")

    def set_supply(self, slave: int, register: int, value: int) -> None:
        """Write a byte of a supply or of the light driver."""
        with self._lock:
            data = bytes([value])
            self._link.control_out(Request.WRITE_SUPPLY, slave << 8, register << 8, data)

    def set_monitor(self, slave: int, register: int, value: int) -> None:
        """Write a word of a current monitor, the high byte first."""
        with self._lock:
            data = value.to_bytes(2, "big")
            self._link.control_out(Request.WRITE_MONITOR, slave, register, data)

    def _read(self, field: Field) -> int:
        answer = self._link.control_in(Request.READ_REGISTER, *field.place, REGISTER_BYTES)
        if len(answer) != REGISTER_BYTES:
            slave, register = field.place
            raise ProtocolError(
                f"register {slave:#04x}:{register:#04x}: {len(answer)} bytes, not {REGISTER_BYTES}"
            )
        return int.from_bytes(answer, "little")
