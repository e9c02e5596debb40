"""The emulated OPT8241-CDK: its registers, and what its pixels measure."""

import numpy as np
import pytest

from tests.opt8241.standing import emulated
from transientcam_driver import TriggeredCamera
from transientcam_driver.clock import VirtualClock
from transientcam_driver.errors import CameraError, TransferStalled
from transientcam_opt8241 import Opt8241, registers as reg
from transientcam_opt8241._control import Control
from transientcam_opt8241.emulated import EmulatedRegisters, build_opt8241
from transientcam_simulation.emulated import find_scene, without_noise

SPEED_OF_LIGHT_M_S = 299_792_458.0


def test_phases_are_those_of_the_path_at_every_frequency() -> None:
    clock, quads = VirtualClock(), 6
    device, simulation = build_opt8241(
        without_noise(find_scene("wall")), seed=1, clock=clock, quads=quads
    )
    with TriggeredCamera(
        lambda: Opt8241(device.connect(), quads=quads), clock=clock, simulation=simulation
    ) as camera:
        wanted = {"base_frequency_hz": 40e6, "harmonics": 2}
        camera.configure(camera.capabilities.sequence_of(wanted))
        camera.start()
        frame = camera.read_frame()
    path_m = 2 * simulation.truth().range_m

    turned = np.exp(2j * np.pi * np.arange(quads) / quads)
    by_frequency = frame.images.reshape(2, quads, 240, 320).astype(float) - 2048
    for images, frequency_hz in zip(by_frequency, (40e6, 80e6), strict=True):
        expected = np.exp(2j * np.pi * frequency_hz * path_m / SPEED_OF_LIGHT_M_S)
        off_rad = np.angle(np.einsum("k,kyx->yx", turned, images) / expected)
        assert np.abs(off_rad).max() < 5e-3  # rounding to 12 bits
    with pytest.raises(CameraError, match="no interlock"):
        simulation.set_interlock(closed=False)


def test_the_pll_takes_effect_when_its_update_ends() -> None:
    registers = EmulatedRegisters()
    assert registers.modulation_hz == pytest.approx(48e6)

    def write(field: reg.Field, value: int) -> None:
        word = field.put(registers._words[field.place], value)
        registers.write(0x09, *field.place, word.to_bytes(3, "little"))

    write(reg.MOD_PLL_UPDATE, 1)
    write(reg.MOD_M1, 25)
    assert registers.modulation_hz == pytest.approx(48e6)
    write(reg.MOD_PLL_UPDATE, 0)
    assert registers.modulation_hz == pytest.approx(75e6)


def test_what_is_beyond_a_limit_is_not_set_and_flagged() -> None:
    device = emulated()
    control = Control(device.connect())

    control.set({reg.INTG_DUTY_CYCLE: 21})
    assert control.get(reg.INTG_DUTY_CYCLE) == 6
    assert control.get(reg.INTG_DUTY_CYCLE_SET_FAILED) == 1
    control.set({reg.INTG_DUTY_CYCLE: 20})
    assert control.get(reg.INTG_DUTY_CYCLE_SET_FAILED) == 0
    control.set({reg.TSENSOR: 1})
    assert control.get(reg.TSENSOR) == 35  # it is read-only
    control.set({reg.SOFTWARE_RESET: 1})
    assert control.get(reg.INTG_DUTY_CYCLE) == 6
    with pytest.raises(TransferStalled):
        device.registers.read(0x17, 0, 0, 3)
    with pytest.raises(TransferStalled):
        device.registers.write(0x09, 0x58, 0x80, b"\0\0")
