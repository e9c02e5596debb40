"""The same promises, however the camera is reached: pyusb's backend, usbfs, a real device.

``pytest tests/driver --usb=real`` runs them on a camera that is plugged in, too.
"""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.driver.mounts import Mount, PyusbMount, RealMount, UsbfsMount
from transientcam_driver import (
    Camera,
    CameraBusy,
    CameraClosed,
    CameraFault,
    CameraLost,
    CameraNotFound,
    CameraState,
    DeviceRefused,
    NotStreaming,
    RawFrame,
    Sequence,
    SequenceError,
    open_camera,
)
from transientcam_driver.clock import VirtualClock

QUICK = Sequence(harmonics=1, zeroth="estimated", exposure_s=0.5e-3)
READ_S = 60.0
MOUNTS: dict[str, Callable[[], Mount]] = {
    "pyusb": PyusbMount,
    "usbfs": UsbfsMount,
    "real": RealMount,
}


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "mounted" in metafunc.fixturenames:
        real = metafunc.config.getoption("--usb") == "real"
        names = [name for name in MOUNTS if name != "real" or real]
        metafunc.parametrize("mounted", names, indirect=True, scope="module")


@pytest.fixture(scope="module")
def mounted(request: pytest.FixtureRequest) -> Iterator[Mount]:
    mount = MOUNTS[request.param]()
    yield mount
    mount.close()


@pytest.fixture
def mount(mounted: Mount) -> Iterator[Mount]:
    yield mounted
    mounted.restore()


@pytest.fixture
def emulated(mount: Mount) -> Mount:
    if not mount.emulated:
        pytest.skip("not possible with a real camera")
    return mount


@pytest.fixture
def camera(mount: Mount) -> Camera:
    return mount.open(sequence=QUICK)


def read(camera: Camera) -> RawFrame:
    return camera.read_frame(timeout_s=READ_S)


def read_on(camera: Camera) -> None:
    """Read until it ends: what had arrived already is delivered first."""
    while True:
        read(camera)


def state_of(camera: Camera) -> CameraState:
    """Read it again: a type checker takes a property for a constant."""
    return camera.state


def light_of(mount: Mount) -> bool:
    return mount.lit


def reconnect(mount: Mount, camera: Camera) -> None:
    for _ in range(1000):
        try:
            camera.reconnect()
        except (CameraNotFound, CameraLost):
            mount.wait()
        else:
            return
    raise AssertionError("the camera does not come back")


@cache
def reference(sequence: Sequence) -> NDArray[np.uint16]:
    """The frame of the noiseless scene, from a camera of its own."""
    with open_camera("sim:wall?noise=off", clock=VirtualClock()) as camera:
        camera.configure(sequence)
        camera.start()
        return camera.read_frame().images


def test_a_real_camera_takes_part_when_it_is_asked_for(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--usb") != "real":
        pytest.skip("no real camera: plug one in and run `pytest tests/driver --usb=real`")
    with open_camera("usb") as camera:
        assert camera.capabilities.serial


def test_an_opened_camera_is_idle_dark_and_configured(mount: Mount, camera: Camera) -> None:
    assert state_of(camera) == CameraState.IDLE
    assert camera.applied.sequence.harmonics == 1
    assert not mount.lit
    assert camera.status().temperature_c == pytest.approx(30, abs=40)
    assert camera.capabilities.protocol_version == 1


def test_frames_come_whole_in_order_and_on_time(mount: Mount, camera: Camera) -> None:
    applied = camera.applied
    camera.start()
    frames = [read(camera) for _ in range(4)]

    capabilities = camera.capabilities
    for frame in frames:
        assert frame.images.shape == (applied.images, capabilities.height, capabilities.width)
        assert frame.labels == applied.labels
        assert frame.capture_s == pytest.approx(1 / applied.frame_rate_hz, rel=0.01)
        if mount.emulated:
            assert np.array_equal(frame.images, reference(QUICK))
    numbers = [frame.number for frame in frames]
    assert numbers == sorted(set(numbers))
    assert mount.lit
    assert (camera.counters.corrupt, camera.counters.resyncs) == (0, 0)


@pytest.mark.parametrize(
    "document",
    [
        {"harmonics": 3, "zeroth": "low-frequency"},
        {"harmonics": 2, "zeroth": "on-off", "sub_phases": {"scheme": "none"}},
        {"harmonics": 2, "takes": 3, "take_order": "interleaved"},
        {"harmonics": 4, "sub_phases": {"scheme": "harmonic-cancellation", "n": 3}},
        {"harmonics": 32, "base_frequency_hz": 2e6, "zeroth": "estimated"},
    ],
    ids=["low-frequency", "on-off", "interleaved", "harmonic-cancellation", "32-harmonics"],
)
def test_every_kind_of_sequence_is_captured(
    mount: Mount, camera: Camera, document: dict[str, Any]
) -> None:
    sequence = Sequence.from_document(document | {"exposure_s": 0.2e-3})
    if not mount.emulated:
        try:
            camera.validate(sequence)
        except SequenceError as error:
            pytest.skip(f"this camera cannot: {error}")
    applied = camera.configure(sequence)
    camera.start()

    frame = read(camera)

    assert frame.labels == applied.labels
    assert len(frame.images) == sequence.images
    if mount.emulated:
        assert np.array_equal(frame.images, reference(sequence))


def test_a_sequence_is_switched_between_two_frames(camera: Camera) -> None:
    camera.start()
    before = read(camera)

    applied = camera.configure(Sequence(harmonics=2, zeroth="estimated", exposure_s=0.5e-3))
    frame = read(camera)

    assert state_of(camera) == CameraState.STREAMING
    assert before.epoch < applied.epoch == frame.epoch
    assert len(frame.images) == 8


def test_an_impossible_sequence_is_refused_by_name_and_changes_nothing(camera: Camera) -> None:
    with pytest.raises(SequenceError) as caught:
        camera.configure(Sequence(base_frequency_hz=1e12))

    assert caught.value.field == "base_frequency_hz"
    assert camera.applied.sequence.harmonics == 1


def test_stop_and_safe_off_switch_the_light_off(mount: Mount, camera: Camera) -> None:
    for switch_off in (camera.stop, camera.safe_off):
        camera.start()
        assert light_of(mount)
        switch_off()
        assert not light_of(mount)
        with pytest.raises(NotStreaming):
            read(camera)


def test_a_closed_camera_is_dark_free_and_of_no_more_use(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    camera.start()
    camera.close()

    assert not emulated.lit
    with pytest.raises(CameraClosed):
        camera.start()
    emulated.another_program()


def test_one_camera_serves_one_program(mount: Mount, camera: Camera) -> None:
    with pytest.raises(CameraBusy, match="another program holds the camera"):
        mount.another_program()

    assert not camera.status().light_on


def test_another_serial_number_is_not_found(mount: Mount) -> None:
    with pytest.raises(CameraNotFound, match="NOT-THIS-ONE"):
        mount.open("usb:NOT-THIS-ONE")


def test_the_device_time_passes(camera: Camera) -> None:
    before_s = camera.device_time_s()
    camera.start()
    read(camera)

    assert camera.device_time_s() > before_s


def test_unplugging_is_reported_and_replugging_resumes(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    camera.start()
    before = read(camera)

    emulated.do("unplug")
    with pytest.raises(CameraLost):
        read_on(camera)
    assert state_of(camera) == CameraState.DISCONNECTED
    with pytest.raises(CameraNotFound):
        camera.reconnect()
    emulated.do("replug")
    reconnect(emulated, camera)
    frame = read(camera)

    assert state_of(camera) == CameraState.STREAMING
    assert frame.epoch > before.epoch
    assert np.array_equal(frame.images, reference(QUICK))


def test_a_halted_endpoint_is_cleared(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    camera.start()
    before = read(camera)
    emulated.do("halt")

    assert read(camera).number > before.number


@pytest.mark.parametrize(
    "fault", ["drop", "corrupt-pixels", "corrupt-header", "shorten", "swap", "babble"]
)
def test_a_bad_image_loses_its_frame_alone(emulated: Mount, fault: str) -> None:
    camera = emulated.open(sequence=QUICK)
    camera.start()
    read(camera)
    emulated.do("inject", fault, 1)

    frames = [read(camera)]
    while not frames[-1].lost_images:  # what had arrived already is delivered
        frames.append(read(camera))

    assert frames[-1].lost_images == 1
    assert camera.counters.lost + camera.counters.corrupt == 1
    assert all(np.array_equal(frame.images, reference(QUICK)) for frame in frames)


def test_a_duplicated_image_is_passed_over(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    emulated.do("inject", "duplicate", 4)
    camera.start()

    frames = [read(camera), read(camera)]

    assert all(np.array_equal(frame.images, reference(QUICK)) for frame in frames)
    assert camera.counters.duplicates == 4
    assert camera.counters.lost == 0


def test_a_stalled_request_is_a_refusal(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    emulated.do("stall", 1)

    with pytest.raises(DeviceRefused) as caught:
        camera.configure(Sequence())

    assert caught.value.request == "SET_SEQUENCE"
    assert camera.applied.sequence.harmonics == 1


def test_an_opened_interlock_is_a_fault(emulated: Mount) -> None:
    camera = emulated.open(sequence=QUICK)
    camera.start()
    read(camera)
    emulated.do("interlock", False)

    with pytest.raises(CameraFault, match="interlock"):
        read_on(camera)
    assert not emulated.lit
    emulated.do("interlock", True)
    camera.start()
    assert np.array_equal(read(camera).images, reference(QUICK))


def test_short_memory_leads_to_smaller_reads(emulated: Mount) -> None:
    emulated.do("memory", 20_000)
    camera = emulated.open(sequence=QUICK)
    camera.start()

    frame = read(camera)

    assert np.array_equal(frame.images, reference(QUICK))
    assert camera.counters.resyncs == 0
