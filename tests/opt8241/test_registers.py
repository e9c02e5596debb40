"""Fields of the registers: their bits, and what is written of them."""

from itertools import combinations

import pytest

from tests.opt8241.standing import emulated
from transientcam_driver import CameraLost, ProtocolError
from transientcam_opt8241 import Field, Request, registers as reg
from transientcam_opt8241._control import Control


def test_no_two_fields_share_a_bit() -> None:
    for one, other in combinations(reg.all_fields(), 2):
        if one.place == other.place:
            assert one.low > other.high or other.low > one.high


def test_a_field_changes_its_own_bits_alone() -> None:
    field = Field(0x58, 0x0C, 21, 16)

    assert field.put(0xFFFFFF, 0x12) == 0b1101_0010_1111_1111_1111_1111
    assert field.of(0x120000) == 0x12
    with pytest.raises(ValueError, match="64 in 6 bits"):
        field.put(0, 64)


def test_a_signed_field_is_a_twos_complement() -> None:
    assert [reg.TSENSOR.of(word) for word in (0x00, 0x7F, 0x80, 0xFF)] == [0, 127, -128, -1]


def test_fields_of_a_register_are_written_together_and_the_others_stay() -> None:
    device = emulated()
    link = device.connect()
    link.control_out(Request.WRITE_REGISTER, 0x58, 0x0C, b"\x01\x02\xc0")

    Control(link).set({reg.MOD_M1: 20, reg.MOD_M_FRAC1: 54613})

    assert link.control_in(Request.READ_REGISTER, 0x58, 0x0C, 3) == b"\x55\xd5\xd4"


def test_a_short_answer_is_no_register() -> None:
    class Short:
        def control_in(self, *_: object) -> bytes:
            return b"\0\0"

    with pytest.raises(ProtocolError, match="0x5c:0x61: 2 bytes, not 3"):
        Control(Short()).get(reg.TSENSOR)  # type: ignore[arg-type]


def test_a_register_of_a_camera_that_is_gone_is_not_remembered() -> None:
    device = emulated()
    control = Control(device.connect())
    control.set({reg.TG_DIS: 0})
    device.unplug()

    with pytest.raises(CameraLost):
        control.set({reg.TG_DIS: 1})
    with pytest.raises(CameraLost):
        control.set({reg.TG_DIS: 1})
