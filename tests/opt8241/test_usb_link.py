"""The link on USB, at the seam to pyusb: the driver captures through what pyusb calls a device."""

import array
import errno
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import usb.core

from tests.opt8241.standing import camera_of, emulated
from transientcam_driver import CameraNotFound, PermissionDenied, TriggeredCamera
from transientcam_driver.cameras.open_usb import _transport
from transientcam_driver.clock import VirtualClock
from transientcam_opt8241 import Opt8241, Request, _usb_link as usb_link, plugin as opt8241
from transientcam_opt8241.emulated import EmulatedOpt8241


class Device:
    """What pyusb finds at a port, with an emulated camera behind it."""

    bus, address, port_numbers = 1, 7, (2, 4)
    iSerialNumber, iProduct = 0, 0  # noqa: N815 - as pyusb has it

    def __init__(self, camera: EmulatedOpt8241) -> None:
        self._link = camera.connect()
        self.claimed: list[int] = []
        self._ctx = SimpleNamespace(
            managed_claim_interface=lambda device, interface: self.claimed.append(interface),
            managed_release_interface=lambda device, interface: self.claimed.remove(interface),
            dispose=lambda device: None,
        )

    def ctrl_transfer(
        self, kind: int, request: int, value: int, index: int, data: Any, timeout_ms: int
    ) -> Any:
        if kind == 0xC0:
            answer = self._link.control_in(Request(request), value, index, data)
            return array.array("B", answer)
        assert kind == 0x40
        self._link.control_out(Request(request), value, index, data)
        return len(data)

    def read(self, endpoint: int, buffer: "array.array[int]", timeout_ms: int) -> int:
        assert endpoint == 0x82
        assert len(buffer) % 512 == 0
        frame = self._link.read(len(buffer), timeout_s=timeout_ms / 1e3)
        if frame is None:
            raise usb.core.USBTimeoutError("timed out", -7, errno.ETIMEDOUT)
        buffer[: len(frame)] = array.array("B", frame)
        return len(frame)

    def clear_halt(self, endpoint: int) -> None:
        assert endpoint == 0x82


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch, clock: VirtualClock) -> Device:
    found = Device(emulated(clock=clock))
    monkeypatch.setattr(_transport, "devices", lambda *_, **__: [found])
    return found


def test_frames_are_those_of_the_emulation_without_usb(device: Device, clock: VirtualClock) -> None:
    other = VirtualClock()
    with (
        TriggeredCamera(lambda: Opt8241(usb_link.SameCamera()()), clock=clock) as camera,
        camera_of(emulated(clock=other), clock=other) as direct,
    ):
        assert camera.capabilities.serial == "@1-2.4"
        assert device.claimed == [0]
        camera.start()
        direct.start()
        frame, expected = camera.read_frame(), direct.read_frame()

    assert np.array_equal(frame.images, expected.images)
    assert device.claimed == []


def test_a_camera_is_listed_by_its_port_where_it_has_no_serial_number(device: Device) -> None:
    found = [each for each in opt8241.PLUGIN.find() if not each.simulated]

    assert [(each.spec, each.node) for each in found] == [
        ("opt8241:@1-2.4", "/dev/bus/usb/001/007")
    ]


def test_another_serial_number_is_not_found(device: Device) -> None:
    with pytest.raises(CameraNotFound):
        usb_link.SameCamera("@1-2.5")()


def test_a_camera_that_may_not_be_opened_is_an_error_with_its_rule(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise usb.core.USBError("Access denied", -3, errno.EACCES)

    monkeypatch.setattr(device._ctx, "managed_claim_interface", refuse)

    with pytest.raises(PermissionDenied, match='idProduct}=="9105"'):
        usb_link.SameCamera()()
