"""The clauses: each function's docstring is the promise, and its body tries it."""

import threading
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from transientcam_driver.camera import Camera, CameraState
from transientcam_driver.contract._bench import Bench
from transientcam_driver.contract._expecting import ContractBroken, ContractSkipped, raises, require
from transientcam_driver.errors import (
    CameraClosed,
    CameraError,
    CameraLost,
    FrameTimeout,
    NotStreaming,
    SequenceError,
)
from transientcam_driver.sequence import Sequence

TRIES: Final = 1000


def an_opened_camera_is_idle_and_dark(bench: Bench) -> None:
    """An opened camera has a sequence that it can do, captures nothing, and its light is off."""
    with bench.open() as camera:
        require(camera.state == CameraState.IDLE, f"its state is {camera.state}")
        require(not bench.light_of(camera), "its light is on")
        again = camera.validate(camera.applied.sequence)
        require(again.epoch == 0, f"validate() gives the epoch {again.epoch}, not 0")
        require(again.images == camera.applied.images, "validate() gives other images")
        with raises(NotStreaming, "read_frame() before start()"):
            camera.read_frame(timeout_s=0.0)


def frames_are_whole_labelled_and_in_order(bench: Bench) -> None:
    """Frames hold the images of the sequence, in the order of its labels, and count up."""
    with bench.prepared() as camera:
        camera.start()
        frames = [bench.read(camera) for _ in range(3)]
        applied, capabilities = camera.applied, camera.capabilities
        shape = (applied.images, capabilities.height, capabilities.width)
    for frame in frames:
        require(frame.images.shape == shape, f"images of {frame.images.shape}, not {shape}")
        require(frame.images.dtype == np.uint16, f"images of {frame.images.dtype}, not uint16")
        require(frame.labels == applied.labels, "labels are not the sequence's")
        require(frame.epoch == applied.epoch, f"epoch {frame.epoch}, not {applied.epoch}")
        require(frame.capture_s > 0, f"capture_s is {frame.capture_s}")
        late_s = frame.host_time_s - frame.device_time_s if capabilities.clock == "ptp" else 0.0
        require(abs(late_s) < 30.0, f"PTP's time is {late_s:.0f} s behind the host's")
    for before, after in pairwise(frames):
        require(after.number > before.number, f"number {after.number} after {before.number}")
        require(after.device_time_s > before.device_time_s, "device_time_s does not grow")
    require(camera.counters.frames >= len(frames), f"counts {camera.counters.frames} frames")


def stop_is_dark_and_start_goes_on(bench: Bench) -> None:
    """stop() and safe_off() switch the light off and end reading; start() goes on."""
    with bench.prepared() as camera:
        for switch_off in (camera.stop, camera.safe_off):
            camera.start()
            bench.read(camera)
            require(camera.state == CameraState.STREAMING, f"its state is {camera.state}")
            switch_off()
            require(not bench.light_of(camera), f"the light is on after {switch_off.__name__}()")
            with raises(NotStreaming, f"read_frame() after {switch_off.__name__}()"):
                bench.read(camera)


def stop_releases_a_waiting_reader(bench: Bench) -> None:
    """A read_frame() that waits ends with NotStreaming once another thread calls stop()."""
    ended: list[BaseException] = []

    def read_on() -> None:
        try:
            while True:
                bench.read(camera)
                begun.set()
        except BaseException as error:
            ended.append(error)
            begun.set()

    begun = threading.Event()
    with bench.prepared() as camera:
        camera.start()
        reader = threading.Thread(target=read_on, name="contract")
        reader.start()
        begun.wait(bench.read_s)
        camera.stop()
        reader.join(bench.read_s)
        require(not reader.is_alive(), "the reader still waits")
    require(isinstance(ended[0], NotStreaming), f"the reader ended with {ended[0]!r}")


def a_timeout_is_no_failure(bench: Bench) -> None:
    """read_frame() without a frame in time raises FrameTimeout, and the capture goes on."""
    with bench.prepared() as camera:
        camera.start()
        for _ in range(3):
            with suppress(FrameTimeout):
                camera.read_frame(timeout_s=0.0)
        require(camera.state == CameraState.STREAMING, f"its state is {camera.state}")
        bench.read(camera)


def an_impossible_sequence_is_refused_by_name(bench: Bench) -> None:
    """A sequence beyond the camera's limits is refused with its field, and changes nothing."""
    with bench.open() as camera:
        before = camera.applied
        for call in (camera.validate, camera.configure):
            with raises(SequenceError, f"{call.__name__}() of 1 THz") as refused:
                call(replace(before.sequence, base_frequency_hz=1e12))
            require(refused.error.field == "base_frequency_hz", f"it names {refused.error.field}")
        require(camera.applied == before, "the sequence has changed")


def a_new_sequence_has_a_new_epoch(bench: Bench) -> None:
    """After configure() the next frame is the new sequence's, with a greater epoch."""
    with bench.prepared() as camera:
        other = _another(camera)
        camera.start()
        before = bench.read(camera)
        applied = camera.configure(other)
        after = bench.read(camera)
        require(camera.state == CameraState.STREAMING, f"its state is {camera.state}")
    require(applied.epoch > before.epoch, f"epoch {applied.epoch} after {before.epoch}")
    require(after.epoch == applied.epoch, f"a frame of epoch {after.epoch} after configure()")
    exposures_s = {label.exposure_s for label in after.labels}
    require(exposures_s == {applied.sequence.exposure_s}, f"exposures of {exposures_s}")


def lost_images_are_counted(bench: Bench) -> None:
    """A lost image costs its frame; the next one says how many were lost, and so do counters."""
    with bench.prepared() as camera:
        camera.start()
        before = bench.read(camera)
        bench.do(camera, "lose_image")
        frames = [bench.read(camera)]
        while not frames[-1].lost_images and len(frames) < TRIES:  # what had arrived before
            frames.append(bench.read(camera))
        require(frames[-1].lost_images > 0, "no frame says that images were lost")
        require(camera.counters.lost > 0, "counters.lost is 0")
        require(frames[-1].number > before.number, "numbers do not grow")


def an_unplugged_camera_is_lost_and_comes_back(bench: Bench) -> None:
    """Without its cable a camera raises CameraLost; with it, reconnect() resumes the capture."""
    with bench.prepared() as camera:
        camera.start()
        before = bench.read(camera)
        bench.do(camera, "unplug")
        try:
            with raises(CameraLost, "read_frame() of an unplugged camera"):
                for _ in range(TRIES):  # what had arrived before is delivered
                    bench.read(camera)
            require(camera.state == CameraState.DISCONNECTED, f"its state is {camera.state}")
            if bench.lit is not None:
                require(not bench.lit(camera), "the light is on without the cable")
            with raises(CameraLost, "status() of an unplugged camera"):
                camera.status()
            with raises(CameraError, "reconnect() without the cable"):
                camera.reconnect()
        finally:
            bench.do(camera, "replug")
        _reconnect(camera)
        after = bench.read(camera)
        require(camera.state == CameraState.STREAMING, f"its state is {camera.state}")
    require(after.epoch > before.epoch, f"epoch {after.epoch} after {before.epoch}")


def a_closed_camera_is_dark_and_free(bench: Bench) -> None:
    """close() in the middle of a capture is final; the camera can be opened again and captures."""
    camera = bench.prepared()
    camera.start()
    bench.read(camera)
    camera.close()
    camera.close()
    for call in (camera.start, camera.status, camera.read_frame):
        with raises(CameraClosed, f"{call.__name__}() after close()"):
            call()
    with bench.prepared() as again:
        require(not bench.light_of(again), "the light is on after close()")
        again.start()
        bench.read(again)


def _reconnect(camera: Camera) -> None:
    """Try until the event of the cable has arrived."""
    pause = threading.Event()
    for _ in range(TRIES):
        try:
            camera.reconnect()
        except CameraError:
            pause.wait(0.02)
        else:
            return
    raise ContractBroken("reconnect() fails with the cable in")


def _another(camera: Camera) -> Sequence:
    """Return another sequence that the camera can do."""
    sequence, capabilities = camera.applied.sequence, camera.capabilities
    longer_s = min(2 * sequence.exposure_s, capabilities.max_exposure_s)
    more = sequence.takes + 1
    for other in (replace(sequence, exposure_s=longer_s), replace(sequence, takes=more)):
        try:
            if camera.validate(other).sequence != camera.validate(sequence).sequence:
                return other
        except SequenceError:
            continue
    raise ContractSkipped("it can do no other sequence")
