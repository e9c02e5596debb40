"""Whatever happens to the cable, frames that are delivered are whole, in order and counted."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule
from hypothesis.strategies import floats, integers, sampled_from
from transientcam_driver import (
    CameraLost,
    CameraNotFound,
    CameraState,
    FrameTimeout,
    NotStreaming,
    Sequence,
    open_camera,
)
from transientcam_driver.simulation.clock import VirtualClock

SEQUENCES = (
    Sequence(harmonics=1, zeroth="estimated"),
    Sequence(harmonics=2, zeroth="on-off", exposure_s=1e-3),
)


class Cable(RuleBasedStateMachine):
    """A camera to which things happen, beside what is known about it."""

    def __init__(self) -> None:
        super().__init__()
        self.clock = VirtualClock()
        self.camera = open_camera("sim:mirrors?noise=off", clock=self.clock)
        assert self.camera.simulation is not None
        self.simulation = self.camera.simulation
        self.device = self.simulation._device
        self.camera.configure(SEQUENCES[0])
        self.expected: dict[int, np.ndarray] = {}
        self.last_number = -1
        self.last_epoch = self.camera.applied.epoch

    def teardown(self) -> None:
        self.camera.close()

    @rule()
    def start(self) -> None:
        try:
            self.camera.start()
        except CameraLost:
            assert not self.simulation.plugged or self.camera.state is CameraState.DISCONNECTED

    @rule()
    def stop(self) -> None:
        try:
            self.camera.stop()
        except CameraLost:
            assert not self.simulation.plugged or self.camera.state is CameraState.DISCONNECTED

    @rule(choice=sampled_from(range(len(SEQUENCES))))
    def configure(self, choice: int) -> None:
        try:
            applied = self.camera.configure(SEQUENCES[choice])
        except CameraLost:
            return
        assert applied.epoch > self.last_epoch
        self.last_epoch = applied.epoch
        self.last_number = -1

    @rule()
    def read(self) -> None:
        try:
            frame = self.camera.read_frame(timeout_s=1.0)
        except (NotStreaming, CameraLost):
            return
        # the rendered scene is the same for each frame of a sequence without noise
        key = len(frame.labels)
        expected = self.expected.setdefault(key, frame.images)
        assert np.array_equal(frame.images, expected)
        assert frame.epoch == self.camera.applied.epoch
        assert frame.number > self.last_number
        self.last_number = frame.number

    @rule(timeout_s=floats(0.0, 0.01))
    def read_impatiently(self, timeout_s: float) -> None:
        with suppress(FrameTimeout, NotStreaming, CameraLost):
            self.last_number = self.camera.read_frame(timeout_s=timeout_s).number

    @rule()
    def unplug(self) -> None:
        self.simulation.unplug()

    @rule()
    def replug(self) -> None:
        self.simulation.replug()

    @rule()
    def reconnect(self) -> None:
        lost = self.camera.state is CameraState.DISCONNECTED
        try:
            self.camera.reconnect()
        except (CameraNotFound, CameraLost):
            assert not self.simulation.plugged
            return
        if lost:
            self.last_number = -1
            self.last_epoch = self.camera.applied.epoch

    @rule()
    def halt(self) -> None:
        self.device.halt()

    @rule(images=integers(1, 5))
    def corrupt(self, images: int) -> None:
        self.simulation.corrupt_next(images)

    @rule(images=integers(1, 5))
    def drop(self, images: int) -> None:
        self.simulation.drop_next(images)

    @rule(duration_s=floats(0.0, 4.0))
    def delay(self, duration_s: float) -> None:
        self.clock.sleep(duration_s)

    @invariant()
    def the_light_is_on_only_while_streaming(self) -> None:
        if self.simulation.plugged and self.camera.state is CameraState.IDLE:
            status = self.device._firmware._status(self.clock.now_s())
            assert not status.light_on


Cable.TestCase.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
TestCable = pytest.mark.filterwarnings("error")(Cable.TestCase)
