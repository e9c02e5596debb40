"""The camera over a simulated bus, in virtual time."""

import threading
from typing import Any

import numpy as np
import pytest

from transientcam_driver import (
    Camera,
    CameraClosed,
    CameraFault,
    CameraLost,
    CameraNotFound,
    CameraState,
    DeviceRefused,
    FrameTimeout,
    NotStreaming,
    ProtocolError,
    Sequence,
    SequenceError,
    Simulation,
    open_camera,
)
from transientcam_driver.cameras.open_usb import UsbCamera, open_transport
from transientcam_driver.cameras.open_usb.protocol import Request
from transientcam_driver.clock import RealClock, VirtualClock
from transientcam_simulation import SimulationHandle
from transientcam_simulation.emulated import build, find_scene
from transientcam_simulation.emulated._open_usb.bus import SimulatedBus
from transientcam_simulation.emulated._open_usb.usb_device import EmulatedDevice

from .conftest import OpenCamera

VIDEO = Sequence(harmonics=3, zeroth="estimated", exposure_s=0.5e-3)


def state_of(camera: Camera) -> CameraState:
    """Read it again: a type checker takes a property for a constant."""
    return camera.state


def device_of(simulation: Simulation) -> EmulatedDevice:
    assert isinstance(simulation, SimulationHandle)
    assert isinstance(simulation._device, EmulatedDevice)
    return simulation._device


def test_an_opened_camera_is_idle_dark_and_configured(camera: Camera) -> None:
    assert state_of(camera) is CameraState.IDLE
    assert camera.applied.sequence == Sequence()
    assert camera.applied.epoch == 1
    assert not camera.status().light_on
    assert (camera.capabilities.width, camera.capabilities.height) == (163, 120)


def test_frames_come_back_to_back_at_the_papers_video_rate(
    camera: Camera, clock: VirtualClock
) -> None:
    applied = camera.configure(VIDEO)
    camera.start()
    frames = [camera.read_frame() for _ in range(5)]

    assert applied.frame_rate_hz == pytest.approx(18.6, abs=0.01)
    assert [frame.number for frame in frames] == [0, 1, 2, 3, 4]
    assert {frame.lost_images for frame in frames} == {0}
    assert np.diff([frame.device_time_s for frame in frames]) == pytest.approx(12 * 4.48e-3)
    assert np.diff([f.host_time_s for f in frames]) == pytest.approx(12 * 4.48e-3, abs=1e-6)
    assert [frame.capture_s for frame in frames] == pytest.approx([12 * 4.48e-3] * 5)
    assert frames[0].host_time_s == pytest.approx(clock.unix_s(), abs=1.0)
    assert frames[0].images.shape == (12, 120, 163)
    assert frames[0].labels == applied.labels
    assert camera.counters.images == 60


@pytest.mark.parametrize(
    "sequence",
    [
        VIDEO,
        Sequence(harmonics=4),
        Sequence(harmonics=1, zeroth="on-off", exposure_s=2e-4),
        Sequence(harmonics=2, takes=3, take_order="interleaved", exposure_s=7e-3),
    ],
)
def test_a_capture_takes_as_long_as_the_sequence_says_by_the_clock_of_the_device(
    sequence: Sequence, camera: Camera
) -> None:
    applied = camera.configure(sequence)
    camera.start()
    single = camera.read_frame()
    camera.stop()
    camera.start()
    first, second = camera.read_frame(), camera.read_frame()

    assert single.capture_s == pytest.approx(applied.capture_s, rel=5e-3)
    assert second.capture_s == pytest.approx(applied.capture_s, rel=5e-3)
    assert second.device_time_s - first.device_time_s == pytest.approx(applied.capture_s, rel=5e-3)
    assert applied.frame_rate_hz == pytest.approx(1 / applied.capture_s)


def test_the_same_seed_gives_the_same_frames(open_virtual: OpenCamera) -> None:
    def frame_bytes(spec: str) -> bytes:
        camera = open_virtual(spec)
        camera.start()
        return camera.read_frame().images.tobytes()

    assert frame_bytes("sim:mirrors?seed=7") == frame_bytes("sim:mirrors?seed=7")
    assert frame_bytes("sim:mirrors?seed=7") != frame_bytes("sim:mirrors?seed=8")


def test_validate_sends_nothing_and_says_what_would_be_set(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(camera, "_transport", None)

    assert camera.validate(VIDEO).images == 12
    assert (
        camera.validate(Sequence(base_frequency_hz=10e6 + 0.1)).sequence.base_frequency_hz == 10e6
    )
    with pytest.raises(SequenceError):
        camera.validate(Sequence(takes=5000))


def test_an_impossible_sequence_changes_nothing(camera: Camera) -> None:
    camera.start()
    camera.read_frame()

    with pytest.raises(SequenceError) as caught:
        camera.configure(Sequence(base_frequency_hz=100e6))

    assert caught.value.field == "base_frequency_hz"
    assert camera.applied.epoch == 1
    assert camera.read_frame().number == 1


def test_configuring_while_streaming_switches_at_once_without_loss(camera: Camera) -> None:
    camera.start()
    camera.read_frame()

    applied = camera.configure(VIDEO)
    frame = camera.read_frame()

    assert state_of(camera) is CameraState.STREAMING
    assert (frame.epoch, len(frame.images), frame.lost_images) == (applied.epoch, 12, 0)
    assert applied.epoch == 2


def test_a_frame_needs_a_start(camera: Camera) -> None:
    with pytest.raises(NotStreaming, match=r"idle.*call start\(\) first"):
        camera.read_frame(timeout_s=1)


def test_stop_switches_the_light_off_and_start_goes_on(camera: Camera) -> None:
    camera.start()
    assert camera.status().light_on
    camera.read_frame()

    camera.stop()

    assert not camera.status().light_on
    assert state_of(camera) is CameraState.IDLE
    with pytest.raises(NotStreaming):
        camera.read_frame(timeout_s=1)
    camera.start()
    frame = camera.read_frame()
    assert (frame.number, frame.lost_images) == (1, 0)


def test_safe_off_switches_the_light_off(camera: Camera) -> None:
    camera.start()
    camera.safe_off()

    assert not camera.status().light_on
    assert state_of(camera) is CameraState.IDLE


def light_of(simulation: Simulation) -> bool:
    """Whether the light is on, read from the device, not by the camera."""
    device = device_of(simulation)
    status = device.control(0xC0, Request.GET_STATUS, 0, 0, 64, b"")
    return bool(status[2] & 1)


def test_close_switches_the_light_off(clock: VirtualClock) -> None:
    camera = open_camera(clock=clock)
    assert camera.simulation is not None
    camera.start()

    camera.close()
    camera.close()

    assert not light_of(camera.simulation)
    for action in (camera.start, camera.status, camera.read_frame, camera.reconnect, camera.stop):
        with pytest.raises(CameraClosed):
            action()


def test_an_exception_switches_the_light_off(clock: VirtualClock) -> None:
    lit = []

    def fail() -> None:
        with open_camera(clock=clock) as camera:
            assert camera.simulation is not None
            lit.append(camera.simulation)
            camera.start()
            raise RuntimeError("of the caller")

    with pytest.raises(RuntimeError, match="of the caller"):
        fail()

    assert not light_of(lit[0])


def test_a_camera_that_is_forgotten_switches_its_light_off_and_warns(clock: VirtualClock) -> None:
    cameras = [open_camera(clock=clock)]
    simulation = cameras[0].simulation
    cameras[0].start()

    with pytest.warns(ResourceWarning, match="left open"):
        cameras.clear()

    assert simulation is not None
    assert not light_of(simulation)


def test_opening_switches_off_what_the_last_owner_left_on(clock: VirtualClock) -> None:
    device, simulation = build(find_scene("mirrors"), width=163, height=120, seed=1, clock=clock)
    bus = SimulatedBus([device])
    crashed = open_transport(backend=bus)
    crashed.control_out(
        Request.SET_SEQUENCE, bytes.fromhex("0101020001000100c02c310000000000a0860100")
    )
    crashed.control_in(Request.COMMIT, length=64)
    crashed.control_out(Request.START)
    crashed.close()
    assert light_of(simulation)

    with UsbCamera(lambda serial: open_transport(serial, backend=bus), clock=clock):
        assert not light_of(simulation)


def test_the_heartbeat_keeps_the_light_on_as_long_as_frames_are_read(
    camera: Camera, clock: VirtualClock
) -> None:
    camera.start()
    start_s = clock.now_s()
    while clock.now_s() < start_s + 3 * camera.capabilities.heartbeat_s:
        assert camera.read_frame().lost_images == 0

    status = camera.status()
    assert status.light_on
    assert not status.watchdog_tripped


def test_the_light_goes_off_when_frames_are_not_read_and_on_again_with_the_next_frame(
    camera: Camera, clock: VirtualClock
) -> None:
    camera.start()
    before = camera.read_frame()
    clock.sleep(60)
    assert not camera.status().light_on

    frame = camera.read_frame()

    assert camera.status().light_on
    assert frame.device_time_s > before.device_time_s + 60  # fresh, not from the FIFO
    assert frame.lost_images == 0


def test_a_host_that_reads_too_late_loses_images_and_is_reported(
    camera: Camera, clock: VirtualClock
) -> None:
    camera.configure(VIDEO)
    camera.start()
    camera.read_frame()
    clock.sleep(1.0)

    frames = [camera.read_frame() for _ in range(5)]

    lost = sum(frame.lost_images for frame in frames)
    assert lost == camera.counters.lost > 100
    assert [frame.number for frame in frames[:2]] == [1, 2]  # what stood in the FIFO
    assert frames[-1].lost_images == 0


def test_a_missing_image_drops_its_frame_and_is_counted(
    camera: Camera, simulation: Simulation
) -> None:
    camera.start()
    camera.read_frame()
    simulation.drop_next(2)

    frame = camera.read_frame()

    assert (frame.number, frame.lost_images) == (2, 2)
    assert camera.counters.lost == 2


def test_a_corrupt_image_drops_its_frame_and_is_counted(
    camera: Camera, simulation: Simulation
) -> None:
    camera.start()
    camera.read_frame()
    simulation.corrupt_next()

    frame = camera.read_frame()

    assert (frame.number, frame.lost_images) == (2, 1)
    assert camera.counters.corrupt == 1
    assert camera.read_frame().lost_images == 0


def test_no_frame_in_time_is_a_timeout_and_the_camera_goes_on(camera: Camera) -> None:
    camera.start()
    with pytest.raises(FrameTimeout, match=r"within 0.05 s"):
        camera.read_frame(timeout_s=0.05)

    assert camera.read_frame().lost_images == 0  # what had come already was kept


def test_a_timeout_of_zero_takes_what_is_there(camera: Camera, clock: VirtualClock) -> None:
    camera.start()

    with pytest.raises(FrameTimeout):
        camera.read_frame(timeout_s=0)


def test_unplugging_raises_camera_lost_and_reconnect_resumes(
    camera: Camera, simulation: Simulation
) -> None:
    camera.configure(VIDEO)
    camera.start()
    camera.read_frame()

    simulation.unplug()
    with pytest.raises(CameraLost):
        camera.read_frame()
    assert state_of(camera) is CameraState.DISCONNECTED
    for _ in range(3):
        with pytest.raises(CameraNotFound, match="SIM-ideal-0"):
            camera.reconnect()
        assert state_of(camera) is CameraState.DISCONNECTED
    with pytest.raises(CameraLost, match="disconnected"):
        camera.read_frame()

    simulation.replug()
    camera.reconnect()
    frame = camera.read_frame()

    assert state_of(camera) is CameraState.STREAMING
    assert (len(frame.images), frame.epoch) == (12, camera.applied.epoch)
    assert camera.applied.epoch == 3  # never one that was used before, although the power was off
    assert camera.applied.sequence == VIDEO


def test_a_camera_lost_while_idle_stays_idle_after_reconnect(
    camera: Camera, simulation: Simulation
) -> None:
    simulation.unplug()
    with pytest.raises(CameraLost):
        camera.status()
    simulation.replug()
    camera.reconnect()

    assert state_of(camera) is CameraState.IDLE
    assert not camera.status().light_on


def test_a_camera_stopped_while_lost_is_not_started_again(
    camera: Camera, simulation: Simulation
) -> None:
    camera.start()
    simulation.unplug()
    with pytest.raises(CameraLost):
        camera.stop()
    simulation.replug()
    camera.reconnect()

    assert state_of(camera) is CameraState.IDLE


def test_reconnect_without_a_loss_does_nothing(camera: Camera) -> None:
    camera.start()
    camera.reconnect()

    assert state_of(camera) is CameraState.STREAMING


def test_a_stall_is_cleared_once(camera: Camera, simulation: Simulation) -> None:
    camera.start()
    camera.read_frame()
    device_of(simulation).halt()

    assert camera.read_frame().lost_images == 0


def test_an_endpoint_that_stalls_twice_is_reset_and_found_again(
    camera: Camera, simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera.start()
    camera.read_frame()
    device_of(simulation).halt()
    monkeypatch.setattr(EmulatedDevice, "clear_halt", lambda _self: None)

    with pytest.raises(CameraLost, match="stalled twice"):
        camera.read_frame()
    camera.reconnect()

    assert camera.read_frame().images.shape == (16, 120, 163)


def test_an_opened_interlock_is_a_fault_that_start_clears(
    camera: Camera, simulation: Simulation
) -> None:
    camera.start()
    camera.read_frame()
    simulation.set_interlock(closed=False)

    with pytest.raises(CameraFault, match="interlock"):
        camera.read_frame()
    assert state_of(camera) is CameraState.FAULTED
    with pytest.raises(DeviceRefused, match="refused START: the interlock is open"):
        camera.start()

    simulation.set_interlock(closed=True)
    camera.start()
    assert camera.read_frame().lost_images == 0


def test_an_answer_that_cannot_be_is_a_protocol_error(
    camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert isinstance(camera, UsbCamera)
    transport: Any = camera._transport
    control_in = transport.control_in

    def lie(request: Request, *, value: int = 0, length: int) -> bytes:
        answer = bytes(control_in(request, value=value, length=length))
        return b"\1\0\0\0" + answer[4:] if request is Request.COMMIT else answer

    monkeypatch.setattr(transport, "control_in", lie)

    with pytest.raises(ProtocolError, match="COMMIT answered"):
        camera.configure(VIDEO)


def test_the_device_gives_its_time(camera: Camera, clock: VirtualClock) -> None:
    before_s = camera.device_time_s()
    clock.sleep(2.5)

    assert camera.device_time_s() - before_s == pytest.approx(2.5)


def test_stop_from_another_thread_ends_a_read_that_is_waiting() -> None:
    """In real time: the reader is on its way into a wait for an image that will not come."""
    with open_camera("sim:mirrors") as camera:
        assert camera.simulation is not None
        reading, ended = threading.Event(), []

        class Telling(RealClock):
            def wait(self, condition: threading.Condition, timeout_s: float) -> None:
                reading.set()
                super().wait(condition, timeout_s)

        device_of(camera.simulation).clock = Telling()
        camera.configure(Sequence(harmonics=32, base_frequency_hz=1e6, exposure_s=50e-3))
        camera.start()

        def read() -> None:
            try:
                camera.read_frame(timeout_s=60)
            except NotStreaming as error:
                ended.append(error)

        reader = threading.Thread(target=read)
        reader.start()
        assert reading.wait(60.0)
        camera.stop()
        reader.join(60.0)

        assert not reader.is_alive()
        assert len(ended) == 1


def test_real_time_frames_arrive_when_they_are_due() -> None:
    with open_camera("sim:mirrors") as camera:
        camera.configure(VIDEO)
        camera.start()
        frames = [camera.read_frame(timeout_s=60.0) for _ in range(3)]

        for frame in frames:  # no frame before its last image was read out
            exposed_s = frame.device_time_s + frame.capture_s
            assert exposed_s <= camera.device_time_s()
        assert np.all(np.diff([frame.device_time_s for frame in frames]) >= 12 * 4.48e-3 - 1e-6)
