"""One test for each thing that goes wrong on a USB cable, at its other end, or in between.

Frames that are delivered are held against what the device sent, byte by byte.
"""

import errno
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
import usb.core

from transientcam_driver import (
    Camera,
    CameraBusy,
    CameraError,
    CameraFault,
    CameraLost,
    CameraNotFound,
    DeviceRefused,
    FirmwareTooOld,
    FrameTimeout,
    ProtocolError,
    RawFrame,
    Sequence,
)
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.faults import Fault

from .bench import CAPABILITIES, Bench, number_of

SEQUENCE = Sequence(harmonics=2, zeroth="on-off", exposure_s=0.5e-3)
COUNT = SEQUENCE.images


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def camera(bench: Bench) -> Iterator[Camera]:
    with bench.open(SEQUENCE) as opened:
        opened.start()
        yield opened


@pytest.fixture
def read(bench: Bench, camera: Camera) -> Callable[[], RawFrame]:
    """Read a frame and hold it against what was sent."""

    def read_frame() -> RawFrame:
        frame = camera.read_frame(timeout_s=60.0)
        bench.require_whole_and_right(frame)
        return frame

    return read_frame


def first_number(frame: RawFrame) -> int:
    return number_of(frame.images[0])


Read = Callable[[], RawFrame]


def test_without_a_fault_every_image_is_delivered(camera: Camera, read: Read) -> None:
    frames = [read() for _ in range(4)]

    assert [first_number(frame) for frame in frames] == [0, COUNT, 2 * COUNT, 3 * COUNT]
    assert camera.counters.images == 4 * COUNT
    assert (camera.counters.lost, camera.counters.corrupt, camera.counters.resyncs) == (0, 0, 0)


def test_missing_packets_are_counted(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.DROP, 3)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 3)
    assert (camera.counters.lost, camera.counters.corrupt) == (3, 0)


def test_a_corrupt_header_loses_its_image_alone(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.CORRUPT_HEADER)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 1)
    assert (camera.counters.lost, camera.counters.resyncs) == (1, 1)


def test_a_corrupt_payload_loses_its_image_alone(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.CORRUPT_PIXELS)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 1)
    assert (camera.counters.lost, camera.counters.corrupt) == (0, 1)


def test_a_short_packet_loses_its_image_alone(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.SHORTEN)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 1)
    assert read().lost_images == 0


def test_duplicated_packets_are_passed_over(bench: Bench, camera: Camera, read: Read) -> None:
    bench.device.inject(Fault.DUPLICATE, COUNT)

    frames = [read(), read()]

    assert [first_number(frame) for frame in frames] == [0, COUNT]
    assert camera.counters.duplicates == COUNT
    assert camera.counters.lost == 0


def test_reordered_packets_never_mix_images(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.SWAP)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 1)
    assert camera.counters.duplicates == 1  # the one that came too late


def test_babble_loses_its_image_alone(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.inject(Fault.BABBLE)

    frame = read()

    assert (first_number(frame), frame.lost_images) == (2 * COUNT, 1)
    assert camera.counters.resyncs == 1


def test_a_halted_endpoint_is_cleared_without_loss(
    bench: Bench, camera: Camera, read: Read
) -> None:
    read()
    bench.device.halt()

    assert first_number(read()) == COUNT
    assert camera.counters.lost == 0


def test_a_stalled_request_is_a_refusal_and_changes_nothing(
    bench: Bench, camera: Camera, read: Read
) -> None:
    read()
    bench.device.stall_next()

    with pytest.raises(DeviceRefused) as caught:
        camera.configure(replace(SEQUENCE, harmonics=1))

    assert caught.value.request == "SET_SEQUENCE"
    assert camera.applied.sequence == SEQUENCE
    assert first_number(read()) == COUNT


def test_a_device_that_stalls_everything_still_goes_dark(bench: Bench, camera: Camera) -> None:
    assert bench.status().light_on
    bench.device.stall_next(2)  # STOP, and then the question why

    camera.stop()

    assert not bench.lit
    assert camera.state == "idle"


def test_unplugging_and_replugging_resumes_the_sequence(
    bench: Bench, camera: Camera, read: Read
) -> None:
    read()
    bench.device.unplug()
    with pytest.raises(CameraLost):
        read()
    with pytest.raises(CameraNotFound, match="BENCH-1"):
        camera.reconnect()
    bench.device.replug()
    camera.reconnect()

    assert first_number(read()) == 0  # the device counts anew since power-up
    assert camera.applied.sequence == SEQUENCE


def test_a_busy_device_is_named(bench: Bench, camera: Camera) -> None:
    with pytest.raises(CameraBusy, match="/dev/bus/usb/001/001"):
        bench.open()


def test_a_device_that_falls_silent_goes_on_where_it_was(
    bench: Bench, camera: Camera, read: Read
) -> None:
    read()
    bench.device.fall_silent(0.07)  # shorter than the FIFO lasts

    frame = read()

    assert (first_number(frame), frame.lost_images) == (COUNT, 0)


def test_a_device_silent_for_too_long_is_a_timeout(bench: Bench, camera: Camera) -> None:
    bench.device.fall_silent(60.0)

    with pytest.raises(FrameTimeout):
        camera.read_frame(timeout_s=0.5)

    assert camera.state == "streaming"


def test_an_opened_interlock_is_reported(bench: Bench, camera: Camera, read: Read) -> None:
    read()
    bench.device.set_interlock(closed=False)

    with pytest.raises(CameraFault, match="interlock"):
        read()

    assert camera.state == "faulted"
    assert not bench.lit


def test_a_shortage_of_memory_leads_to_smaller_reads_without_loss(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    large = replace(CAPABILITIES, width=200, height=200, fifo_bytes=2**24)
    monkeypatch.setattr("tests.driver.bench.WIDTH", 200)
    monkeypatch.setattr("tests.driver.bench.HEIGHT", 200)
    bench = Bench(large)
    read, sizes = SimulatedBus.bulk_read, []

    def short_of_memory(bus: Any, handle: Any, ep: int, intf: int, buff: Any, timeout: int) -> int:
        sizes.append(len(buff))
        if len(buff) > 20_000:
            raise usb.core.USBError("Insufficient memory", -11, errno.ENOMEM)
        return read(bus, handle, ep, intf, buff, timeout)

    monkeypatch.setattr(SimulatedBus, "bulk_read", short_of_memory)
    with bench.open(SEQUENCE) as camera:
        camera.start()
        frame = camera.read_frame()

        bench.require_whole_and_right(frame)
        assert (frame.lost_images, camera.counters.resyncs) == (0, 0)
    assert all(next_ <= size for size, next_ in pairwise(sizes))
    assert sizes[0] > 80_000


def test_no_memory_at_all_is_an_error_of_the_camera(
    bench: Bench, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_memory(*_: Any) -> int:
        raise usb.core.USBError("Insufficient memory", -11, errno.ENOMEM)

    monkeypatch.setattr(SimulatedBus, "bulk_read", no_memory)

    with pytest.raises(CameraError, match="Insufficient memory"):
        camera.read_frame()


def test_firmware_of_another_protocol_is_refused_and_left_dark() -> None:
    bench = Bench(announced=replace(CAPABILITIES, protocol_version=0))

    with pytest.raises(FirmwareTooOld, match="version 0 found, version 1 needed"):
        bench.open()

    assert not bench.lit
    with pytest.raises(FirmwareTooOld):  # and the device was given back: it is not busy
        bench.open()


def test_a_device_that_says_another_resolution_than_it_has_is_caught() -> None:
    bench = Bench(announced=replace(CAPABILITIES, width=16))

    with bench.open(SEQUENCE) as camera:
        camera.start()
        with pytest.raises(ProtocolError, match="images of 120 bytes, its capabilities say 160"):
            camera.read_frame(timeout_s=1.0)


def test_a_device_that_says_another_read_out_than_it_has_is_caught() -> None:
    bench = Bench(announced=replace(CAPABILITIES, streaming_readout_s=1e-3))

    with pytest.raises(ProtocolError, match="COMMIT answered"):
        bench.open(SEQUENCE)


def test_a_device_that_refuses_what_it_said_it_could_is_named() -> None:
    bench = Bench(announced=replace(CAPABILITIES, max_frequency_hz=1e9))

    with bench.open(SEQUENCE) as camera:
        with pytest.raises(DeviceRefused) as caught:
            camera.configure(replace(SEQUENCE, base_frequency_hz=400e6))

        assert (caught.value.request, caught.value.code) == ("SET_SEQUENCE", "BAD_VALUE")
        assert "base_frequency_hz" in caught.value.detail
        assert camera.applied.sequence == SEQUENCE


@pytest.mark.parametrize(
    ("lie", "name"),
    [
        ({"width": 0}, "0 for width"),
        ({"schemes": ()}, "0 for known schemes"),
        ({"zeroths": ()}, "0 for known ways to the zeroth moment"),
        ({"fifo_bytes": 100}, "100 for FIFO"),
        ({"heartbeat_s": 0.0}, "0.0 for heartbeat"),
    ],
)
def test_capabilities_that_cannot_be_are_refused(lie: dict[str, Any], name: str) -> None:
    with pytest.raises(ProtocolError, match=name):
        Bench(announced=replace(CAPABILITIES, **lie)).open()


def test_a_camera_that_can_do_less_than_the_default_is_opened_with_what_it_can() -> None:
    lesser = replace(CAPABILITIES, max_harmonics=2, zeroths=("on-off",), schemes=("none",))
    bench = Bench(lesser)

    with bench.open() as camera:
        camera.start()
        frame = camera.read_frame()

    applied = camera.applied.sequence
    assert (applied.harmonics, applied.zeroth, applied.sub_phases.scheme) == (2, "on-off", "none")
    bench.require_whole_and_right(frame)


@pytest.mark.parametrize("take_order", ["sequential", "interleaved"])
@pytest.mark.parametrize("harmonics", [1, 5, 32])
@pytest.mark.parametrize("zeroth", ["low-frequency", "on-off", "estimated"])
def test_every_kind_of_sequence_is_captured_as_it_is_labelled(
    bench: Bench, harmonics: int, zeroth: Any, take_order: Any
) -> None:
    sequence = Sequence(4e6, harmonics, zeroth, 100e-6, takes=3, take_order=take_order)
    with bench.open(sequence) as camera:
        camera.start()
        frame = camera.read_frame()

    bench.require_whole_and_right(frame)
    assert frame.labels == sequence.labels
    assert frame.capture_s == pytest.approx(1 / camera.applied.frame_rate_hz, rel=1e-6)
