"""Devices that do what nobody asked for: it costs a frame or a pixel, or is refused in words."""

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from transientcam_driver import (
    CameraLost,
    Capture,
    Description,
    Exposure,
    FrameTimeout,
    FreeRunningCamera,
    Moment,
    Sequence,
)
from transientcam_supervisor import OffSwitch

PHASES_RAD = [k * math.pi / 2 for k in range(4)]
EXPOSURES = tuple(Exposure(20e6, phase_rad) for phase_rad in PHASES_RAD)
ABOUT = Description(
    model="odd",
    serial="1",
    firmware="1",
    width=3,
    height=2,
    frame_rate_hz=1000.0,
    measurements=EXPOSURES,
)


class Device:
    """Hands over the captures it was given, one after another, and the last one for ever."""

    off_switch = OffSwitch()

    def __init__(self, about: Description, captures: list[Capture]) -> None:
        self.description, self._captures, self._next = about, captures, 0
        self._stopped = threading.Event()
        self.wanted = threading.Semaphore(0)

    def start(self, exposure_s: float) -> None:
        self._stopped.clear()

    def receive(self, timeout_s: float) -> Capture | None:
        if not self.wanted.acquire(timeout=timeout_s):
            return None
        found = self._captures[min(self._next, len(self._captures) - 1)]
        self._next += 1
        return found

    def temperature_c(self) -> float | None:
        return None

    def light_off(self) -> None:
        self._stopped.set()

    def close(self) -> None:
        self._stopped.set()


def image(value: Any = 1000, shape: tuple[int, int] = (2, 3), dtype: Any = np.uint16) -> Any:
    return np.full(shape, value, dtype)


def good(number: int, time_s: float | None = None) -> Capture:
    return Capture([image()] * 4, number, number / 1000 if time_s is None else time_s)


_Read = Callable[..., Any]


@pytest.fixture
def read() -> Iterator[_Read]:
    """Read a frame once the device has handed over some captures, each when it is wanted."""
    cameras: list[Any] = []

    def of(captures: list[Capture], about: Description = ABOUT, takes: int = 1) -> Any:
        device = Device(about, captures)
        camera = FreeRunningCamera(lambda: device, silence_s=60.0, unread_s=600.0)
        cameras.append(camera)
        camera.configure(replace(camera.applied.sequence, takes=takes))
        camera.start()
        taken = camera._take

        def take(timeout_s: float) -> Capture | None:
            device.wanted.release()
            return taken(max(timeout_s, 1.0))

        camera._take = take  # type: ignore[method-assign]  # no capture is overwritten by the next
        return camera

    yield of
    for camera in cameras:
        camera.close()


@pytest.mark.parametrize(
    "bad",
    [
        Capture([image()] * 3, 1, 0.001),
        Capture([image(shape=(3, 2))] * 4, 1, 0.001),
        Capture([image(1 + 2j, dtype=complex)] * 4, 1, 0.001),
        Capture([image("a", dtype="U1")] * 4, 1, 0.001),
        Capture([[[1, 2, 3], [1, 2]]] * 4, 1, 0.001),  # type: ignore[list-item]  # ragged
        Capture([image()] * 4, 1, math.nan),
        Capture([image()] * 4, 1, "noon"),  # type: ignore[arg-type]
        Capture([image()] * 4, 1, 1.7e18),
        Capture([image()] * 4, 1, 0.001, None, math.nan),
    ],
    ids=["few", "turned", "complex", "text", "ragged", "no time", "words", "in ns", "no length"],
)
def test_a_frame_that_does_not_fit_costs_that_frame_alone(read: _Read, bad: Capture) -> None:
    camera = read([good(0), bad, good(2)])

    first, second = camera.read_frame(timeout_s=60.0), camera.read_frame(timeout_s=60.0)

    assert (first.number, second.number) == (0, 2)
    assert second.lost_images == 4
    assert second.device_time_s == 0.002


def test_a_device_whose_frames_never_fit_is_lost_with_the_reason() -> None:
    device = Device(ABOUT, [Capture([image()] * 3, 0, 0.0)])
    camera = FreeRunningCamera(lambda: device, silence_s=0.3)
    for _ in range(100_000):
        device.wanted.release()
    camera.start()

    with pytest.raises(
        CameraLost, match=r"frames that do not fit: .*images is .* allowed: a frame of"
    ):
        camera.read_frame(timeout_s=60.0)

    camera.close()


def test_a_camera_of_few_frames_is_waited_for() -> None:
    device = Device(replace(ABOUT, frame_rate_hz=1.0), [good(0)])
    camera = FreeRunningCamera(lambda: device, silence_s=0.1, unread_s=600.0)
    camera.start()
    with pytest.raises(FrameTimeout):
        camera.read_frame(timeout_s=0.3)
    device.wanted.release()
    assert camera.read_frame(timeout_s=60.0).number == 0
    camera.close()


def test_a_receive_that_ends_its_thread_is_said() -> None:
    class Ends(Device):
        def receive(self, timeout_s: float) -> Capture | None:
            raise SystemExit(3)

    camera = FreeRunningCamera(lambda: Ends(ABOUT, []), silence_s=60.0)
    camera.start()
    with pytest.raises(CameraLost, match=r"receive\(\) raised SystemExit\(3\)"):
        camera.read_frame(timeout_s=60.0)
    camera.close()


def test_a_pixel_that_lacks_one_moment_is_spoilt_and_one_without_any_is_dark(read: _Read) -> None:
    about = replace(ABOUT, measurements=(Moment(20e6, 0.01, 2.0), Moment(100e6, 0.01, 2.0)))
    moments = [image(1 + 1j, dtype=complex) for _ in range(2)]
    moments[0][0, 0] = moments[1][0, 0] = moments[0][1, 1] = math.nan

    found = read([Capture(moments, 0, 0.0)], about).read_frame(timeout_s=60.0).images

    assert (found[:, 0, 0] == 32768).all()
    assert (found[:4, 1, 1] == 65535).all()
    assert (found[4:, 1, 1] == found[4:, 0, 1]).all()


def test_a_receive_that_hangs_is_left_behind_and_said() -> None:
    hangs = threading.Event()

    class Hanging(Device):
        def receive(self, timeout_s: float) -> Capture | None:
            hangs.wait()
            return None

    device = Hanging(ABOUT, [good(0)])
    camera = FreeRunningCamera(lambda: device, silence_s=0.3)
    camera.start()

    with pytest.raises(CameraLost, match=r"0 frames since it was opened"):
        camera.read_frame(timeout_s=60.0)

    assert device._stopped.is_set()  # the light
    camera.close()
    hangs.set()


def test_what_is_no_capture_is_named() -> None:
    class Odd(Device):
        def receive(self, timeout_s: float) -> Any:
            return ["an image"]

    camera = FreeRunningCamera(lambda: Odd(ABOUT, []), silence_s=60.0)
    camera.start()

    with pytest.raises(CameraLost, match=r"\['an image'\] is no Capture"):
        camera.read_frame(timeout_s=60.0)

    camera.close()


def test_counters_of_numpy_neither_overflow_nor_lose(read: _Read) -> None:
    numbers: list[Any] = [np.uint8(254), np.uint8(255), np.uint16(256)]
    camera = read([good(each, 0.001 * k) for k, each in enumerate(numbers)])

    frames = [camera.read_frame(timeout_s=60.0) for _ in numbers]

    assert sum(each.lost_images for each in frames) == 0
    with pytest.raises(TypeError, match="integer"):
        good(None, 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pixels_of_exposures_that_are_no_number_count_as_saturated(
    read: _Read, value: float
) -> None:
    images = [image(1000.0, dtype=np.float32) for _ in PHASES_RAD]
    images[2][1, 2] = value

    found = read([Capture(images, 0, 0.0)]).read_frame(timeout_s=60.0).images

    assert (found[:, 1, 2] == 65535).all()
    assert (found[:, :, :2] < 65535).all()


@pytest.mark.parametrize("dtype", [np.float16, np.int32, ">u2", np.uint8, bool])
def test_any_numbers_are_taken(read: _Read, dtype: Any) -> None:
    about = replace(ABOUT, bits=8)
    images = [image(value, dtype=dtype) for value in (1, 0, 1, 1)]

    found = read([Capture(images, 0, 0.0)], about).read_frame(timeout_s=60.0).images

    step = int(found[0, 0, 0]) - int(found[1, 0, 0])
    assert step == pytest.approx((65535 - 4096) / 256, abs=1)
    assert found[2, 1, 1] == found[0, 0, 0]


def test_time_that_goes_backwards_makes_no_negative_capture(read: _Read) -> None:
    camera = read([good(0, 5.0), good(1, 2.0)], takes=2)

    frame = camera.read_frame(timeout_s=60.0)

    assert frame.device_time_s == 5.0
    assert frame.capture_s == pytest.approx(1e-3)


def test_a_counter_that_begins_anew_loses_nothing(read: _Read) -> None:
    camera = read([good(900), good(0), good(1)])

    frames = [camera.read_frame(timeout_s=60.0) for _ in range(3)]

    assert [each.number for each in frames] == [0, 1, 2]
    assert sum(each.lost_images for each in frames) == 0


@pytest.mark.parametrize(
    "measurements", [EXPOSURES, (Moment(20e6, 0.01, 2.0),)], ids=["exposures", "a moment"]
)
def test_one_pixel_and_one_frequency_are_a_camera(read: _Read, measurements: Any) -> None:
    about = replace(ABOUT, width=1, height=1, measurements=measurements)
    whole = [image(0.5, (1, 1), float)] * len(measurements)

    camera = read([Capture(whole, 0, 0.0)], about)
    frame = camera.read_frame(timeout_s=60.0)

    assert camera.capabilities.sampling.multiples == (1,)
    assert isinstance(camera.applied.sequence, Sequence)
    assert frame.images.shape == (4, 1, 1)
