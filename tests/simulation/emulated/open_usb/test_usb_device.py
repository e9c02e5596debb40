"""The emulated device and its bus, seen through pyusb."""

import array
import errno
import struct
import threading
from collections.abc import Iterator
from typing import Any

import pytest
import usb.core
import usb.util

from transientcam_driver.cameras.open_usb.protocol import PRODUCT_ID, VENDOR_ID, Request
from transientcam_driver.clock import Clock, RealClock, VirtualClock
from transientcam_simulation.emulated import build, find_scene
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.usb_device import EmulatedDevice


def emulated(clock: Clock) -> EmulatedDevice:
    device, _ = build(find_scene("mirrors"), width=163, height=120, seed=1, clock=clock)
    return device


def find(bus: SimulatedBus) -> Any:
    return usb.core.find(idVendor=VENDOR_ID, idProduct=PRODUCT_ID, backend=bus)


@pytest.fixture
def device(clock: VirtualClock) -> EmulatedDevice:
    return emulated(clock)


@pytest.fixture
def bus(device: EmulatedDevice) -> SimulatedBus:
    return SimulatedBus([device])


@pytest.fixture
def found(bus: SimulatedBus) -> Iterator[Any]:
    device = find(bus)
    yield device
    usb.util.dispose_resources(device)


def test_it_is_found_and_named(found: Any) -> None:
    assert (found.product, found.serial_number) == ("AMCW lidar (simulated)", "SIM-ideal-0")
    assert found.manufacturer == "transientcam"
    interface = found.get_active_configuration()[(0, 0)]
    assert interface.bInterfaceClass == 0xFF
    assert [endpoint.bEndpointAddress for endpoint in interface] == [0x81]


def test_lengths_inside_the_descriptors_are_right(found: Any) -> None:
    for kind, most in ((1, 18), (2, 4096), (15, 4096)):
        data = bytes(found.ctrl_transfer(0x80, 6, kind << 8, 0, most))
        total = data[0] if kind == 1 else struct.unpack_from("<H", data, 2)[0]
        assert total == len(data)
        at = 0
        while kind != 15 and at < len(data):  # a chain of descriptors, each with its length
            at += data[at]
        assert kind == 15 or at == len(data)


def test_the_bos_leads_to_the_microsoft_descriptor(found: Any) -> None:
    bos = bytes(found.ctrl_transfer(0x80, 6, 15 << 8, 0, 4096))
    platform = bos.index(bytes.fromhex("DF60DDD88945C74C9CD2659D9E648A9F"))
    _version, length, request, _ = struct.unpack_from("<IHBB", bos, platform + 16)

    microsoft = bytes(found.ctrl_transfer(0xC0, request, 0, 7, 4096))

    assert len(microsoft) == length == struct.unpack_from("<H", microsoft, 8)[0]
    assert b"WINUSB" in microsoft
    at = 0
    while at < len(microsoft):
        at += struct.unpack_from("<H", microsoft, at)[0]
    assert at == len(microsoft)


def test_an_unknown_request_stalls(found: Any) -> None:
    with pytest.raises(usb.core.USBError) as caught:
        found.ctrl_transfer(0xC0, 0x77, 0, 0, 4)

    assert caught.value.errno == errno.EPIPE


def test_reading_without_images_times_out(found: Any) -> None:
    with pytest.raises(usb.core.USBTimeoutError):
        found.read(0x81, 512, timeout=100)


def start(found: Any) -> None:
    """Configure the shortest sequence by hand and start."""
    words = struct.pack("<BBBBBxHIII", 1, 1, 2, 0, 1, 1, 92_000_000, 0, 1_000_000)
    found.ctrl_transfer(0x40, Request.SET_SEQUENCE, 0, 0, words)
    found.ctrl_transfer(0xC0, Request.COMMIT, 0, 0, 64)
    found.ctrl_transfer(0x40, Request.START, 0, 0, b"")


def test_one_transfer_is_one_image(found: Any) -> None:
    start(found)
    buffer = array.array("B", bytes(1 << 20))

    assert found.read(0x81, buffer, timeout=100) == 64 + 163 * 120 * 2
    assert buffer[:4].tobytes() == b"TCIM"


def test_an_image_may_be_read_in_pieces(found: Any) -> None:
    start(found)

    pieces = [bytes(found.read(0x81, 16384, timeout=100)) for _ in range(3)]

    assert [len(piece) for piece in pieces] == [16384, 16384, 39184 - 2 * 16384]


def test_a_read_that_ends_inside_a_packet_overflows(found: Any) -> None:
    start(found)

    with pytest.raises(usb.core.USBError) as caught:
        found.read(0x81, 1000, timeout=100)

    assert caught.value.errno == errno.EOVERFLOW


def test_a_halted_endpoint_stalls_until_it_is_cleared(found: Any, device: EmulatedDevice) -> None:
    start(found)
    device.halt()
    with pytest.raises(usb.core.USBError) as caught:
        found.read(0x81, 65536, timeout=100)
    assert caught.value.errno == errno.EPIPE
    assert bytes(found.ctrl_transfer(0x82, 0, 0, 0x81, 2)) == b"\1\0"

    found.clear_halt(0x81)

    assert len(found.read(0x81, 65536, timeout=100)) == 39184


def test_a_second_owner_is_reported_it_is_busy(found: Any, bus: SimulatedBus) -> None:
    usb.util.claim_interface(found, 0)
    other = find(bus)

    with pytest.raises(usb.core.USBError) as caught:
        usb.util.claim_interface(other, 0)

    assert caught.value.errno == errno.EBUSY
    usb.util.release_interface(found, 0)
    usb.util.claim_interface(other, 0)
    usb.util.dispose_resources(other)


def test_an_unplugged_device_is_neither_found_nor_answers(
    found: Any, bus: SimulatedBus, device: EmulatedDevice
) -> None:
    start(found)
    device.unplug()

    assert find(bus) is None
    for action in (
        lambda: found.read(0x81, 512, timeout=100),
        lambda: found.ctrl_transfer(0xC0, Request.GET_TIME, 0, 0, 8),
        lambda: found.clear_halt(0x81),
        found.reset,
    ):
        with pytest.raises(usb.core.USBError) as caught:
            action()
        assert caught.value.errno == errno.ENODEV


def test_a_handle_dies_with_its_cable_also_after_replug(
    found: Any, bus: SimulatedBus, device: EmulatedDevice
) -> None:
    start(found)
    device.unplug()
    device.replug()

    with pytest.raises(usb.core.USBError) as caught:
        found.ctrl_transfer(0xC0, Request.GET_TIME, 0, 0, 8)
    assert caught.value.errno == errno.ENODEV
    again = find(bus)
    assert again.address != found.address
    assert struct.unpack("<Q", again.ctrl_transfer(0xC0, Request.GET_TIME, 0, 0, 8)) == (0,)
    usb.util.dispose_resources(again)


def test_reset_starts_the_device_anew(found: Any, clock: VirtualClock) -> None:
    clock.sleep(5)
    found.reset()

    assert struct.unpack("<Q", found.ctrl_transfer(0xC0, Request.GET_TIME, 0, 0, 8)) == (0,)


@pytest.mark.parametrize("replug", [False, True])
def test_unplugging_wakes_a_read_that_is_waiting(replug: bool) -> None:
    device = emulated(RealClock())
    waiting, ended = threading.Event(), []
    wait = device.clock.wait

    class Telling(RealClock):
        def wait(self, condition: threading.Condition, timeout_s: float) -> None:
            waiting.set()
            wait(condition, timeout_s)

    device.clock = Telling()
    found = find(SimulatedBus([device]))

    def read() -> None:
        try:
            found.read(0x81, 512, timeout=60_000)
        except usb.core.USBError as error:
            ended.append(error.errno)

    reader = threading.Thread(target=read)
    reader.start()
    assert waiting.wait(60.0)
    device.unplug()
    if replug:
        device.replug()
    reader.join(60.0)

    assert not reader.is_alive()
    assert ended == [errno.ENODEV]
    usb.util.dispose_resources(found)
