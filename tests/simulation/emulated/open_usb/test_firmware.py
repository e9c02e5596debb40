"""The firmware by itself: requests in, answers and packets out, time as an argument."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from transientcam_driver import ImageLabel, Sequence
from transientcam_driver.camera import DeviceState, Status
from transientcam_driver.cameras.open_usb._receiving.decoder import ImagePacket, PacketDecoder
from transientcam_driver.cameras.open_usb.protocol import (
    Commitment,
    ErrorCode,
    ImageFlag,
    Request,
    SequenceWords,
    unpack_capabilities,
    unpack_last_error,
    unpack_status,
    unpack_time,
)
from transientcam_simulation.emulated._open_usb.firmware import Firmware, Refusal
from transientcam_simulation.emulated._open_usb.prototype import prototype

CAPABILITIES = replace(prototype(serial="T", width=4, height=3, bits=12), fifo_bytes=8 * 88)
SEQUENCE = Sequence(harmonics=1, zeroth="on-off", exposure_s=1.02e-3)
PERIOD_S = 5e-3  # 1.02 ms exposure and 3.98 ms read-out
COUNT = 6
POWER_ON_S = 100.0


class Renderer:
    """Pixels that hold the image's number; remembers which images were rendered."""

    def __init__(self) -> None:
        self.rendered: list[int] = []
        self.prepared = 0

    def configure(self, sequence: Sequence, labels: tuple[ImageLabel, ...]) -> None:
        self.labels = labels

    def prepare(self) -> None:
        self.prepared += 1

    def image(self, label: ImageLabel, *, number: int, device_time_s: float) -> NDArray[np.uint16]:
        self.rendered.append(number)
        return np.full((3, 4), number, np.uint16)

    def temperature_c(self, device_time_s: float) -> float:
        return 25.0


class Device:
    """A firmware at a time that the test sets."""

    def __init__(self, *, configured: bool = True) -> None:
        self.renderer = Renderer()
        self.firmware = Firmware(CAPABILITIES, self.renderer, power_on_s=POWER_ON_S)
        self.now_s = POWER_ON_S
        self.decoder = PacketDecoder(payload_bytes=24)
        if configured:
            self.configure(SEQUENCE)

    def read_answer(self, request: int, value: int = 0) -> bytes:
        return self.firmware.control_in(request, value & 0xFFFF, value >> 16, now_s=self.now_s)

    def write(self, request: int, data: bytes = b"") -> None:
        self.firmware.control_out(request, data, now_s=self.now_s)

    def configure(self, sequence: Sequence, epoch_above: int = 0) -> Commitment:
        self.write(Request.SET_SEQUENCE, SequenceWords.of(sequence, CAPABILITIES).pack())
        return Commitment.unpack(self.read_answer(Request.COMMIT, epoch_above))

    def status(self) -> Status:
        return unpack_status(self.read_answer(Request.GET_STATUS))

    def read(self) -> list[ImagePacket]:
        """Read all that is there."""
        packets = []
        while (data := self.firmware.read(now_s=self.now_s)) is not None:
            packets += self.decoder.feed(data)
        return packets

    def numbers(self) -> list[int]:
        return [packet.header.number for packet in self.read()]

    def refusal(self) -> tuple[str, str, str]:
        return unpack_last_error(self.read_answer(Request.GET_LAST_ERROR))


@pytest.fixture
def device() -> Device:
    return Device()


def test_it_gives_its_capabilities_and_its_time(device: Device) -> None:
    device.now_s += 1.25

    assert unpack_capabilities(device.read_answer(Request.GET_CAPS)) == CAPABILITIES
    assert unpack_time(device.read_answer(Request.GET_TIME)) == 1.25


def test_after_power_up_it_is_idle_dark_and_has_no_sequence() -> None:
    device = Device(configured=False)

    status = device.status()

    assert (status.state, status.light_on, status.epoch) == (DeviceState.IDLE, False, 0)
    with pytest.raises(Refusal) as caught:
        device.write(Request.START)
    assert caught.value.code is ErrorCode.NOT_CONFIGURED
    assert device.refusal() == ("START", "NOT_CONFIGURED", "no sequence committed")
    with pytest.raises(Refusal):
        device.read_answer(Request.COMMIT)


def test_commit_answers_with_what_was_really_set() -> None:
    answer = Device(configured=False).configure(SEQUENCE)

    assert answer == Commitment(
        epoch=1,
        images=COUNT,
        first_image=0,
        image_period_ns=5_000_000,
        words=SequenceWords.of(SEQUENCE, CAPABILITIES),
    )


def test_a_staged_sequence_changes_nothing_before_commit(device: Device) -> None:
    device.write(Request.SET_SEQUENCE, SequenceWords.of(Sequence(), CAPABILITIES).pack())

    assert device.status().epoch == 1
    device.write(Request.START)
    device.now_s += PERIOD_S
    (packet,) = device.read()
    assert packet.header.count == COUNT


def test_commit_may_be_repeated(device: Device) -> None:
    first = Commitment.unpack(device.read_answer(Request.COMMIT))

    assert Commitment.unpack(device.read_answer(Request.COMMIT)) == first


def test_epochs_stay_above_the_one_the_host_knows(device: Device) -> None:
    assert device.configure(SEQUENCE, epoch_above=70_000).epoch == 70_001
    assert device.configure(SEQUENCE, epoch_above=3).epoch == 70_002


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"harmonics": 0}, "harmonics = 0"),
        ({"takes": 0}, "takes = 0"),
        ({"exposure_ns": 10}, "exposure_s = 1e-08"),
        ({"base_word": 2**32 - 1}, "base_frequency_hz"),
        ({"zeroth": 77}, "unknown code 77"),
    ],
)
def test_an_impossible_sequence_is_stalled_and_explained(
    device: Device, change: dict[str, int], reason: str
) -> None:
    words = replace(SequenceWords.of(SEQUENCE, CAPABILITIES), **change)

    with pytest.raises(Refusal):
        device.write(Request.SET_SEQUENCE, words.pack())

    request, code, detail = device.refusal()
    assert (request, code) == ("SET_SEQUENCE", "BAD_VALUE")
    assert reason in detail
    assert device.status().epoch == 1


def test_a_sequence_of_the_wrong_length_is_stalled(device: Device) -> None:
    with pytest.raises(Refusal):
        device.write(Request.SET_SEQUENCE, b"short")

    assert device.refusal() == ("SET_SEQUENCE", "BAD_LENGTH", "5 bytes, 20 needed")


def test_unknown_requests_are_stalled_in_both_directions(device: Device) -> None:
    for call in (device.read_answer, device.write):
        with pytest.raises(Refusal):
            call(0x77)
        assert device.refusal()[1] == "UNKNOWN_REQUEST"


def test_image_k_stands_in_the_fifo_at_start_plus_k_plus_1_periods(device: Device) -> None:
    device.write(Request.START)

    for k in range(20):
        assert device.firmware.due_s() == pytest.approx(POWER_ON_S + (k + 1) * PERIOD_S)
        device.now_s = POWER_ON_S + (k + 1) * PERIOD_S - 1e-6
        assert device.read() == []
        device.now_s += 2e-6
        (packet,) = device.read()
        assert packet.header.number == k
        assert packet.header.device_time_ns == pytest.approx(k * 5_000_000, abs=1)


def test_headers_label_images_as_the_sequence_does(device: Device) -> None:
    device.write(Request.START)
    device.now_s += COUNT * PERIOD_S + 1e-6

    headers = [packet.header for packet in device.read()]

    assert [header.index for header in headers] == list(range(COUNT))
    assert {(header.count, header.frame, header.epoch) for header in headers} == {(COUNT, 0, 1)}
    assert [header.tuning_word for header in headers] == [0, 0] + [92_000_000] * 4
    assert [header.phase for header in headers] == [0, 0, 0, 16384, 32768, 49152]
    assert [ImageFlag.ILLUMINATION in header.flags for header in headers] == [
        True, False, True, True, True, True,
    ]  # fmt: skip
    assert [ImageFlag.FIRST_OF_FRAME in header.flags for header in headers] == [True] + [False] * 5
    assert [ImageFlag.LAST_OF_FRAME in header.flags for header in headers] == [False] * 5 + [True]


def test_a_host_that_reads_too_late_loses_the_rest_of_the_frame(device: Device) -> None:
    device.write(Request.START)  # the FIFO has room for 8 images, a frame has 6
    device.now_s += 11 * PERIOD_S + 1e-6

    assert device.numbers() == list(range(8))
    assert device.status().dropped_images == 3
    device.now_s += 3 * PERIOD_S
    packets = device.read()
    assert [packet.header.number for packet in packets] == [12, 13]
    assert [ImageFlag.OVERFLOW in packet.header.flags for packet in packets] == [True, False]
    assert device.status().dropped_images == 4
    assert device.status().fifo_high_water_bytes == 8 * 88


def test_a_host_that_is_always_too_slow_still_gets_whole_frames(device: Device) -> None:
    device.write(Request.START)
    whole, seen = 0, []
    for _ in range(600):  # reads one image in the time of two
        device.now_s += 2 * PERIOD_S
        device.write(Request.HEARTBEAT)
        data = device.firmware.read(now_s=device.now_s)
        if data is not None:
            (packet,) = device.decoder.feed(data)
            seen.append((packet.header.frame, packet.header.index))
    for k in range(len(seen) - COUNT + 1):
        whole += seen[k : k + COUNT] == [(seen[k][0], index) for index in range(COUNT)]

    assert whole > 40  # of at most 100: the host takes 600 images


def test_images_that_are_not_read_are_not_rendered(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 1.9

    assert device.status().dropped_images > 300
    assert device.renderer.rendered == []


def test_an_image_rendered_ahead_is_not_rendered_again(device: Device) -> None:
    device.write(Request.START)

    device.firmware.prepare()
    device.firmware.prepare()
    device.now_s += PERIOD_S + 1e-6

    assert device.numbers() == [0]
    assert device.renderer.rendered == [0]


def test_preparing_after_an_overflow_renders_what_will_be_read(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 9 * PERIOD_S + 1e-6
    device.numbers()

    device.firmware.prepare()
    assert device.firmware.due_s() == pytest.approx(POWER_ON_S + 13 * PERIOD_S)
    device.now_s = POWER_ON_S + 13 * PERIOD_S + 1e-6

    (packet,) = device.read()
    assert packet.header.number == 12
    assert ImageFlag.OVERFLOW in packet.header.flags
    assert device.renderer.rendered[-1] == 12


def test_numbers_and_frames_go_on_after_stop_and_start(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 4 * PERIOD_S + 1e-6
    device.write(Request.STOP)
    device.write(Request.START)
    device.now_s += PERIOD_S + 1e-6

    (packet,) = device.read()

    assert (packet.header.number, packet.header.frame, packet.header.index) == (4, 1, 0)


def test_images_exposed_before_stop_stay_readable(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 3 * PERIOD_S + 1e-6
    device.write(Request.STOP)
    device.now_s += 1.0

    assert not device.status().light_on
    assert device.numbers() == [0, 1, 2]
    assert device.firmware.due_s() is None


def test_flush_empties_the_fifo(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 3 * PERIOD_S + 1e-6
    device.write(Request.FLUSH)
    device.now_s += PERIOD_S

    assert device.numbers() == [3]


def test_commit_while_streaming_switches_at_once_and_says_the_first_number(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 4 * PERIOD_S + 1e-6

    answer = device.configure(Sequence(harmonics=1, zeroth="estimated", exposure_s=1.02e-3))
    device.now_s += 4 * PERIOD_S + 1e-6
    headers = [packet.header for packet in device.read()]

    assert (answer.epoch, answer.first_image) == (2, 4)
    assert [header.number for header in headers] == [4, 5, 6, 7]
    assert {(header.epoch, header.frame, header.count) for header in headers} == {(2, 1, 4)}
    assert device.status().state is DeviceState.STREAMING


def test_what_the_emulator_takes_to_prepare_a_sequence_costs_no_images_and_no_heartbeat(
    device: Device,
) -> None:
    device.write(Request.START)
    device.now_s += 1.5
    assert len(device.numbers()) == 8, "as many as the FIFO holds"
    answer = device.configure(Sequence(harmonics=1, zeroth="estimated", exposure_s=1.02e-3))
    device.now_s += 3.0  # more than the watchdog waits
    device.firmware.resume(device.now_s)
    device.now_s += 2 * PERIOD_S + 1e-6

    headers = [packet.header for packet in device.read()]
    assert [header.number for header in headers] == [answer.first_image, answer.first_image + 1]
    assert headers[0].device_time_ns == pytest.approx(4.5e9, abs=1e3)
    assert device.status().light_on

    device.firmware.resume(device.now_s + 1.0)
    assert [packet.header.number for packet in device.read()] == [], "nothing begins again"


def test_light_is_prepared_when_images_begin_and_not_for_a_sequence_that_takes_none(
    device: Device,
) -> None:
    assert device.renderer.prepared == 0

    device.write(Request.START)
    device.now_s += 2.0  # which it took
    device.firmware.resume(device.now_s)
    device.now_s += PERIOD_S + 1e-6

    assert device.renderer.prepared == 1
    assert device.numbers() == [0]
    device.configure(Sequence(harmonics=1))
    assert device.renderer.prepared == 2


def test_the_light_goes_off_when_the_heartbeat_stops(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 1.5
    device.write(Request.HEARTBEAT)
    device.now_s += 1.9
    assert device.status().light_on

    device.now_s += 0.2
    status = device.status()

    assert (status.state, status.light_on, status.watchdog_tripped) == (
        DeviceState.IDLE,
        False,
        True,
    )
    device.write(Request.START)
    assert not device.status().watchdog_tripped


def test_no_image_is_exposed_after_the_watchdog(device: Device) -> None:
    device.write(Request.START)
    device.now_s += 60.0

    assert device.status().next_image == 400  # 2 s of images of 5 ms


def test_an_open_interlock_switches_off_and_is_reported(device: Device) -> None:
    device.write(Request.START)
    device.firmware.set_interlock(device.now_s, closed=False)

    status = device.status()
    assert (status.state, status.light_on) == (DeviceState.FAULTED, False)
    with pytest.raises(Refusal) as caught:
        device.write(Request.START)
    assert caught.value.code is ErrorCode.INTERLOCK_OPEN

    device.firmware.set_interlock(device.now_s, closed=True)
    device.write(Request.START)
    assert device.status().light_on


def test_safe_off_is_obeyed_in_every_state(device: Device) -> None:
    Device(configured=False).write(Request.SAFE_OFF)
    device.write(Request.SAFE_OFF)
    device.write(Request.START)
    device.write(Request.SAFE_OFF)
    assert not device.status().light_on
    device.firmware.set_interlock(device.now_s, closed=False)
    device.write(Request.SAFE_OFF)
