"""What users are told of a light that no watchdog of the camera switches off."""

from types import SimpleNamespace
from typing import Any

import pytest

from transientcam_driver import open_camera
from transientcam_driver.camera import light_warning
from transientcam_supervisor import OffSwitch, UsbReset

RESET = OffSwitch("/dev/bus/usb/001/001", (UsbReset(),))


def camera(switch: OffSwitch | None, *, heartbeat_s: float = 0.0) -> Any:
    capabilities = SimpleNamespace(heartbeat_s=heartbeat_s)
    return SimpleNamespace(simulation=None, off_switch=switch, capabilities=capabilities)


@pytest.mark.parametrize(
    ("switch", "said"),
    [
        (OffSwitch(), "no other process can switch its light off"),
        (RESET, "A supervisor switches its light off"),
    ],
)
def test_a_light_without_a_watchdog_is_warned_of(switch: OffSwitch, said: str) -> None:
    assert said in str(light_warning(camera(switch)))


def test_one_that_goes_off_by_itself_or_is_not_there_is_not() -> None:
    assert light_warning(camera(RESET, heartbeat_s=2.0)) is None
    assert light_warning(camera(OffSwitch(ends_s=0.3))) is None
    assert light_warning(camera(None)) is None
    with open_camera("kinect2:emulated") as emulated:
        assert light_warning(emulated) is None
        assert emulated.capabilities.heartbeat_s == 0.0  # a thread of this process is none
