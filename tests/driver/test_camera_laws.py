"""Whatever happens to the cable: frames are whole and right, counters add up, the light obeys."""

import gc
import threading
import tracemalloc
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from hypothesis.strategies import floats, integers, sampled_from

from tests.driver.bench import Bench, number_of
from transientcam_driver import (
    CameraFault,
    CameraLost,
    CameraNotFound,
    CameraState,
    DeviceRefused,
    FrameTimeout,
    NotStreaming,
    Sequence,
)
from transientcam_driver.cameras.open_usb._receiving.assembler import FrameAssembler
from transientcam_simulation.emulated._open_usb.faults import Fault

SEQUENCES = (
    Sequence(harmonics=1, zeroth="estimated"),
    Sequence(harmonics=2, zeroth="on-off", exposure_s=1e-3, takes=2, take_order="interleaved"),
)


NO_FRAME = (CameraFault, CameraLost, DeviceRefused, FrameTimeout, NotStreaming)
"""What reading may raise, and nothing else."""


class Ledger:
    """How many images the driver has accounted for, by the sequence numbers it has passed."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._closed = 0
        self._run: tuple[FrameAssembler, int] | None = None
        restart = FrameAssembler.restart

        def restarting(assembler: FrameAssembler, first_image: int) -> None:
            self._closed = self.passed
            restart(assembler, first_image)
            self._run = assembler, first_image

        patch.setattr(FrameAssembler, "restart", restarting)

    @property
    def passed(self) -> int:
        if self._run is None:
            return self._closed
        assembler, first_image = self._run
        return self._closed + assembler._next_number - first_image


class Cable(RuleBasedStateMachine):
    """A camera to which things happen, beside what is known about it."""

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.ledger = Ledger(self.patch)
        self.bench = Bench()
        self.device = self.bench.device
        self.camera = self.bench.open(SEQUENCES[0])
        self.delivered = 0
        self.lost_images = 0
        self.last_image = -1
        self.last_epoch = self.camera.applied.epoch

    def teardown(self) -> None:
        self.camera.close()
        self.patch.undo()
        assert not self.device.plugged or not self.lit()

    def lit(self) -> bool:
        """Read it from the device itself, also where requests are stalled."""
        now_s = self.bench.clock.now_s()
        self.device._firmware._advance(now_s)
        return self.device._firmware._status(now_s).light_on

    def take(self, timeout_s: float) -> None:
        frame = self.camera.read_frame(timeout_s=timeout_s)
        self.bench.require_whole_and_right(frame)
        assert frame.epoch == self.camera.applied.epoch
        assert number_of(frame.images[0]) > self.last_image
        self.last_image = number_of(frame.images[-1])
        self.delivered += 1
        self.lost_images += frame.lost_images

    # --- what a program does --------------------------------------------------------------

    @initialize()
    def begin(self) -> None:
        self.camera.start()
        self.take(1.0)

    @rule()
    def start(self) -> None:
        with suppress(CameraLost, DeviceRefused):
            self.camera.start()

    @rule()
    def stop(self) -> None:
        with suppress(CameraLost):  # a refused STOP becomes a SAFE_OFF
            self.camera.stop()
            assert self.camera.state is CameraState.IDLE

    @rule(choice=sampled_from(SEQUENCES))
    def configure(self, choice: Sequence) -> None:
        before = self.camera.applied
        try:
            applied = self.camera.configure(choice)
        except (CameraLost, DeviceRefused):
            assert self.camera.applied == before
            return
        assert applied.epoch > self.last_epoch
        self.last_epoch = applied.epoch

    @rule()
    def push(self) -> None:
        """The device pushes images until a frame is whole."""
        with suppress(*NO_FRAME):
            self.take(1.0)

    @rule(timeout_s=floats(0.0, 0.01))
    def push_a_little(self, timeout_s: float) -> None:
        with suppress(*NO_FRAME):
            self.take(timeout_s)

    @rule()
    def reconnect(self) -> None:
        lost = self.camera.state is CameraState.DISCONNECTED
        try:
            self.camera.reconnect()
        except (CameraNotFound, CameraLost):
            assert not self.device.plugged
        except DeviceRefused:
            assert self.camera.state is not CameraState.STREAMING
        if lost and self.device.plugged:
            self.last_image = -1  # the power was off
        if self.camera.state is not CameraState.DISCONNECTED:
            self.last_epoch = self.camera.applied.epoch

    # --- what happens to it ---------------------------------------------------------------

    @rule()
    def unplug(self) -> None:
        self.device.unplug()

    @rule()
    def replug(self) -> None:
        self.device.replug()

    @rule()
    def halt(self) -> None:
        self.device.halt()

    @rule(requests=integers(1, 3))
    def stall(self, requests: int) -> None:
        self.device.stall_next(requests)

    @rule(images=integers(1, 5))
    def short(self, images: int) -> None:
        self.device.inject(Fault.SHORTEN, images)

    @rule(images=integers(1, 5), fault=sampled_from([Fault.CORRUPT_PIXELS, Fault.CORRUPT_HEADER]))
    def corrupt(self, images: int, fault: Fault) -> None:
        self.device.inject(fault, images)

    @rule(images=integers(1, 5), fault=sampled_from(list(Fault)))
    def disturb(self, images: int, fault: Fault) -> None:
        self.device.inject(fault, images)

    @rule(duration_s=floats(0.0, 4.0))
    def delay(self, duration_s: float) -> None:
        """No frame is read for some time."""
        self.bench.clock.sleep(duration_s)

    @rule(duration_s=floats(0.0, 0.5))
    def fall_silent(self, duration_s: float) -> None:
        self.device.fall_silent(duration_s)

    @rule(closed=sampled_from([True, True, False]))
    def interlock(self, closed: bool) -> None:
        self.device.set_interlock(closed=closed)

    # --- what holds whatever happens ------------------------------------------------------

    @invariant()
    def the_light_is_on_only_while_frames_are_read(self) -> None:
        if self.device.plugged and self.lit():
            assert self.camera.state is CameraState.STREAMING
            silent_s = self.bench.clock.now_s() - self.camera._heartbeat_s
            assert silent_s <= self.camera.capabilities.heartbeat_s

    @invariant()
    def counters_add_up(self) -> None:
        counters = self.camera.counters
        assert counters.images + counters.lost + counters.corrupt == self.ledger.passed
        assert self.delivered <= counters.frames
        assert self.lost_images <= counters.lost + counters.corrupt
        assert counters.frames * 4 <= counters.images


def test_a_thousand_unplugs_leave_nothing_behind() -> None:
    """No thread, no descriptor, no object, and no more memory than a rounding of it."""
    bench = Bench()
    with bench.open(SEQUENCES[0]) as camera:
        camera.start()

        def cycle() -> None:
            bench.device.unplug()
            with pytest.raises(CameraLost):
                camera.read_frame()
            bench.device.replug()
            camera.reconnect()
            bench.require_whole_and_right(camera.read_frame())
            bench.images.labels.clear()

        for _ in range(20):  # what is allocated once
            cycle()
        before = _footprint()
        tracemalloc.start()
        gc.collect()
        first_bytes, _ = tracemalloc.get_traced_memory()
        for _ in range(1000):
            cycle()
        gc.collect()
        last_bytes, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()

        assert _footprint() == before
        assert last_bytes - first_bytes < 100_000  # a hundred bytes a cycle
        assert camera.applied.epoch == 1021


def _footprint() -> tuple[int, int]:
    return threading.active_count(), len(list(Path("/proc/self/fd").iterdir()))


Cable.TestCase.settings = settings(max_examples=100, stateful_step_count=50, deadline=None)
TestCable = pytest.mark.filterwarnings("error")(Cable.TestCase)
