"""Every error of pyusb becomes one of ours."""

import errno
from pathlib import Path
from typing import Any

import pytest
import usb.core

from transientcam_driver import (
    CameraBusy,
    CameraError,
    CameraLost,
    CameraNotFound,
    LibusbMissing,
    PermissionDenied,
)
from transientcam_driver.camera import FoundCamera
from transientcam_driver.cameras.kinect2 import UDEV_RULES
from transientcam_driver.cameras.open_usb import UDEV_RULE, _transport, list_cameras, open_transport
from transientcam_driver.cameras.open_usb.protocol import Request
from transientcam_driver.clock import VirtualClock
from transientcam_driver.errors import UDEV_RULES_FILE, TransferOverflow, TransferStalled
from transientcam_opt8241 import _usb_link as usb_link
from transientcam_simulation.emulated import build, find_scene
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.usb_device import EmulatedDevice


def plug(scene: str = "mirrors") -> EmulatedDevice:
    device, _ = build(find_scene(scene), width=163, height=120, seed=1, clock=VirtualClock())
    return device


@pytest.fixture
def device() -> EmulatedDevice:
    return plug()


@pytest.fixture
def bus(device: EmulatedDevice) -> SimulatedBus:
    return SimulatedBus([device])


def test_a_camera_is_found_by_its_serial_number(bus: SimulatedBus) -> None:
    transport = open_transport("SIM-ideal-0", backend=bus)

    assert transport.serial == "SIM-ideal-0"
    transport.close()


def test_another_serial_number_is_not_found(bus: SimulatedBus) -> None:
    with pytest.raises(CameraNotFound, match="'X-1'"):
        open_transport("X-1", backend=bus)


def test_an_empty_bus_has_no_camera() -> None:
    with pytest.raises(CameraNotFound, match="no camera is plugged in"):
        open_transport(backend=SimulatedBus([]))


def test_a_claimed_camera_is_busy_until_it_is_closed(bus: SimulatedBus) -> None:
    first = open_transport(backend=bus)
    with pytest.raises(CameraBusy, match=r"/dev/bus/usb/001/001"):
        open_transport(backend=bus)
    first.close()

    open_transport(backend=bus).close()


def test_a_busy_camera_does_not_hide_a_free_one() -> None:
    bus = SimulatedBus([plug(), plug()])
    first, second = open_transport(backend=bus), open_transport(backend=bus)

    with pytest.raises(CameraBusy):
        open_transport(backend=bus)
    first.close()
    second.close()


def fail(monkeypatch: pytest.MonkeyPatch, method: str, error: Exception) -> None:
    def raising(*_: Any) -> None:
        raise error

    monkeypatch.setattr(SimulatedBus, method, raising)


def test_without_permission_the_udev_rule_is_reported(
    bus: SimulatedBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail(monkeypatch, "open_device", usb.core.USBError("Access denied", -3, errno.EACCES))

    with pytest.raises(PermissionDenied) as caught:
        open_transport(backend=bus)

    assert UDEV_RULE in str(caught.value)
    assert "/etc/udev/rules.d/60-transientcam.rules" in str(caught.value)
    assert "plugdev" in str(caught.value)
    assert 'ATTR{idVendor}=="1209", ATTR{idProduct}=="0001"' in UDEV_RULE


def test_a_missing_libusb_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def find(**_: Any) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", find)

    with pytest.raises(LibusbMissing, match=r"apt install libusb-1\.0-0"):
        open_transport()


# every code of libusb (libusb.h) as pyusb's backend hands it on: text, code, errno
LIBUSB_ERRORS = [
    ("Input/Output Error", -1, errno.EIO, CameraLost),
    ("Invalid parameter", -2, errno.EINVAL, CameraError),
    ("Access denied", -3, errno.EACCES, PermissionDenied),
    ("No such device", -4, errno.ENODEV, CameraLost),
    ("Entity not found", -5, errno.ENOENT, CameraLost),
    ("Resource busy", -6, errno.EBUSY, CameraBusy),
    ("Overflow", -8, errno.EOVERFLOW, TransferOverflow),
    ("Pipe error", -9, errno.EPIPE, TransferStalled),
    ("System call interrupted", -10, errno.EINTR, CameraError),
    ("Insufficient memory", -11, errno.ENOMEM, CameraError),
    ("Unknown error", -99, None, CameraLost),
    ("Protocol error", -1, errno.EPROTO, CameraLost),
    ("Shut down", -1, errno.ESHUTDOWN, CameraLost),
]


@pytest.mark.parametrize(("text", "code", "number", "expected"), LIBUSB_ERRORS)
@pytest.mark.parametrize("method", ["bulk_read", "ctrl_transfer"])
def test_every_error_of_libusb_becomes_one_of_ours(
    bus: SimulatedBus,
    monkeypatch: pytest.MonkeyPatch,
    text: str,
    code: int,
    number: int | None,
    expected: type[CameraError],
    method: str,
) -> None:
    transport = open_transport(backend=bus)
    fail(monkeypatch, method, usb.core.USBError(text, code, number))

    def use() -> None:
        if method == "bulk_read":
            transport.read(timeout_s=0.1)
        else:
            transport.control_in(Request.GET_TIME, length=8)

    with pytest.raises(CameraError) as caught:
        use()

    assert type(caught.value) is expected
    assert isinstance(caught.value.__cause__, usb.core.USBError)
    monkeypatch.undo()
    transport.close()


def test_what_libusb_does_not_support_means_the_device_is_gone(
    bus: SimulatedBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    transport = open_transport(backend=bus)
    fail(monkeypatch, "bulk_read", NotImplementedError("not supported"))

    with pytest.raises(CameraLost):
        transport.read(timeout_s=0.1)
    transport.close()


def test_a_request_without_an_answer_means_the_device_is_gone(
    bus: SimulatedBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    transport = open_transport(backend=bus)
    fail(monkeypatch, "ctrl_transfer", usb.core.USBTimeoutError("timed out", -7, errno.ETIMEDOUT))

    with pytest.raises(CameraLost, match="GET_TIME: no answer within 1 s"):
        transport.control_in(Request.GET_TIME, length=8)
    monkeypatch.undo()
    transport.close()


def test_a_read_without_an_image_is_empty(bus: SimulatedBus) -> None:
    transport = open_transport(backend=bus)

    assert len(transport.read(timeout_s=0.1)) == 0
    transport.close()


def test_closing_a_camera_that_is_gone_is_no_error(
    bus: SimulatedBus, device: EmulatedDevice
) -> None:
    transport = open_transport(backend=bus)
    device.unplug()

    transport.close()
    transport.close()


def test_pyusb_is_imported_in_two_places_only() -> None:
    import transientcam_driver
    import transientcam_simulation

    packages = [
        Path(path)
        for each in (transientcam_driver, transientcam_simulation)
        for path in each.__path__
    ]
    importing = {
        str(path.relative_to(package.parent))
        for package in packages
        for path in package.rglob("*.py")
        for line in path.read_text().splitlines()
        if line.startswith(("import usb", "from usb"))
    }
    assert importing == {
        "transientcam_driver/cameras/open_usb/_transport.py",
        "transientcam_simulation/emulated/_open_usb/bus.py",
    }


def test_cameras_are_listed_without_being_claimed(bus: SimulatedBus) -> None:
    owned = open_transport(backend=bus)

    (found,) = list_cameras(backend=bus)

    assert found == FoundCamera(
        "usb:SIM-ideal-0", "SIM-ideal-0", "AMCW lidar (simulated)", "/dev/bus/usb/001/001"
    )
    owned.close()


def test_a_camera_that_may_not_be_opened_is_listed_with_its_problem(
    bus: SimulatedBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail(monkeypatch, "open_device", usb.core.USBError("Access denied", -3, errno.EACCES))

    (found,) = list_cameras(backend=bus)

    assert (found.serial, found.spec) == (None, "usb:@1-1")
    assert UDEV_RULE in str(found.problem)


def test_an_empty_bus_lists_no_camera() -> None:
    assert list_cameras(backend=SimulatedBus([])) == ()


def test_the_file_for_udev_holds_the_rules_that_errors_name() -> None:
    file = Path(__file__).parents[4] / "packaging" / Path(UDEV_RULES_FILE).name
    rules = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    named = [UDEV_RULE, usb_link.UDEV_RULE, *(line.strip() for line in UDEV_RULES.splitlines())]

    # and more: the file also gives each camera a name by its serial number
    for rule, each in zip(rules, named, strict=True):
        assert set(each.split(", ")) <= set(rule.split(", "))
    assert UDEV_RULES_FILE in str(PermissionDenied("/dev/bus/usb/001/002", UDEV_RULE))


class Device:
    """What the transport reads of a device of pyusb."""

    iSerialNumber, iProduct = 3, 2  # noqa: N815 - pyusb's names

    def __init__(self, port: int, serial: str) -> None:
        self.bus, self.address, self.port_numbers, self.serial = 1, 10 + port, (port,), serial


@pytest.mark.parametrize(
    ("serial", "name", "known_as"), [("0001", "@1-2", "0001@1-2"), ("", "@1-2", "@1-2")]
)
def test_twins_have_names_of_their_own_and_calibrations_too(
    monkeypatch: pytest.MonkeyPatch, serial: str, name: str, known_as: str
) -> None:
    there = [Device(1, serial), Device(2, serial)]
    monkeypatch.setattr(_transport, "devices", lambda *_, **__: there)
    monkeypatch.setattr(usb.util, "get_string", lambda device, *_: device.serial)
    monkeypatch.setattr(usb.util, "dispose_resources", lambda device: None)
    monkeypatch.setattr(usb.util, "claim_interface", lambda *_: None)

    assert [each.spec for each in list_cameras()] == ["usb:@1-1", "usb:@1-2"]
    opened = open_transport(name)
    assert opened.serial + opened.suffix == known_as
