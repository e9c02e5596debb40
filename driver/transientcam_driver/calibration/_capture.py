"""Capture of a calibration measurement with a camera.

The images are taken while the light shines at the sensor through a filter and a diffuser, so that
every pixel should measure the same at every frequency (Peters et al. 2015, Sec. 4.2).
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from transientcam_driver.calibration._file import CalibrationCapture
from transientcam_driver.calibration._sweep import PhaseSweep, Waveform
from transientcam_driver.camera import Camera, RawFrame
from transientcam_driver.errors import CameraError, FrameTimeout, SequenceError
from transientcam_driver.sequence import Sequence

DEFAULT_TAKES = 40
"""Of the paper's calibration measurements."""
_TIMEOUT_FRAMES = 5.0  # of a read, in times of a frame, and at least:
_LEAST_TIMEOUT_S = 10.0
_POLL_S = 0.25

Averaging = Callable[[NDArray[np.uint16]], tuple[NDArray[Any], NDArray[np.bool_]]]
"""From takes of one image (takes, 1, H, W) to their mean (1, H, W), and which were kept
(takes, 1)."""
Progress = Callable[[int, int], None]
"""Called with the number of frames captured, and of all, several times a second; an exception that
it raises ends the measurement."""


def mean_of_takes(takes: NDArray[np.uint16]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Average takes (takes, N, H, W), keeping every image."""
    return takes.mean(axis=0), np.ones(takes.shape[:2], dtype=bool)


def capture_calibration(
    camera: Camera,
    *,
    takes: int = DEFAULT_TAKES,
    average: Averaging = mean_of_takes,
    waveform: Waveform | None = None,
    progress: Progress | None = None,
) -> CalibrationCapture:
    """Measure with the camera's present sequence while its light shines at the sensor (Sec. 4.2).

    Dark images come first, with the same exposure. The sequence is then restored, and the light
    is off, also where the measurement fails or is interrupted.

    Parameters
    ----------
    camera
        Idle; no other thread may read from it meanwhile.
    takes
        How often each image is captured, at least 2.
    average
        From the takes of an image to one; their mean by default.
    waveform
        Evaluates a phase sweep, which follows; none is captured, when left out, with fewer than
        30 takes, and with a camera that cannot shift its phases.
    progress
        Called after each frame, and while waiting for one.

    Raises
    ------
    SequenceError
        For fewer than two takes.
    CameraError
        The camera was lost, or gives no frames.
    """
    if takes < 2:
        raise SequenceError("takes", takes, "at least 2 for a calibration")
    before = camera.applied.sequence
    single = replace(before, takes=1, take_order="sequential")
    fewest = len(single.sampling.multiples) or 1
    in_the_dark = replace(single, harmonics=fewest, zeroth="on-off")
    with_dark = "on-off" in camera.capabilities.zeroths
    sweep = PhaseSweep.beside(takes) if camera.capabilities.phase_offsets else None
    before_sweep = takes * (1 + with_dark)
    total = before_sweep + (sweep.frames if sweep and waveform else 0)

    def report(done: int) -> None:
        if progress is not None:
            progress(done, total)

    try:
        dark = _dark(_frames(camera, in_the_dark, takes, report)) if with_dark else None
        frames = _frames(camera, single, takes, lambda done: report(before_sweep - takes + done))
        applied = camera.applied
        harmonics = None
        if sweep is not None and waveform is not None:
            harmonics = waveform(_steps(camera, sweep, single, report, before_sweep))
    finally:
        with suppress(CameraError):  # a lost camera switches its light off by its watchdog
            camera.stop()
        with suppress(CameraError):  # a lost camera is configured by its reconnect
            camera.configure(before)
    # image by image, so that the takes of a large sensor are not in memory twice
    averaged = [
        average(np.stack([frame.images[k : k + 1] for frame in frames]))
        for k in range(applied.images)
    ]
    known_c = [each.temperature_c for each in frames if each.temperature_c is not None]
    return CalibrationCapture(
        images=np.concatenate([images for images, _ in averaged]).astype(np.float32),
        kept=np.concatenate([kept for _, kept in averaged], axis=1),
        sequence=applied.sequence,
        low_frequency_hz=applied.low_frequency_hz,
        serial=camera.capabilities.serial,
        model=camera.capabilities.model,
        firmware=camera.capabilities.firmware,
        temperature_c=float(np.mean(known_c)) if known_c else None,
        captured_unix_s=frames[-1].host_time_s,
        dark=None if dark is None else dark.mean(axis=0),
        dark_deviation=None if dark is None else dark.std(axis=0, ddof=1),
        waveform=harmonics,
    )


def _steps(
    camera: Camera,
    sweep: PhaseSweep,
    single: Sequence,
    report: Callable[[int], None],
    done_before: int,
) -> Iterator[NDArray[np.uint16]]:
    """Capture the takes (takes, 4 m, H, W) of b_1 .. b_m, one step of a sweep after the other."""
    for step, sequence in enumerate(sweep.sequences(single)):

        def done(frames: int, before: int = done_before + step * sweep.takes) -> None:
            report(before + frames)

        frames = _frames(camera, sequence, sweep.takes, done)
        swept = [label.index for label in frames[0].labels if label.harmonic]
        yield np.stack([frame.images[swept] for frame in frames])


def _frames(
    camera: Camera, sequence: Sequence, takes: int, report: Callable[[int], None]
) -> list[RawFrame]:
    applied = camera.configure(sequence)
    timeout_s = max(_LEAST_TIMEOUT_S, _TIMEOUT_FRAMES / applied.frame_rate_hz)
    frames = []
    camera.start()
    for taken in range(takes):
        frames.append(_frame(camera, timeout_s, partial(report, taken)))
        report(taken + 1)
    camera.stop()
    return frames


def _frame(camera: Camera, timeout_s: float, still_waiting: Callable[[], None]) -> RawFrame:
    for _ in range(math.ceil(timeout_s / _POLL_S) - 1):
        with suppress(FrameTimeout):
            return camera.read_frame(timeout_s=_POLL_S)
        still_waiting()
    return camera.read_frame(timeout_s=_POLL_S)


def _dark(frames: list[RawFrame]) -> NDArray[np.float32]:
    """Return the images without light, one of each frame."""
    (dark,) = (label.index for label in frames[0].labels if not label.illumination)
    return np.stack([frame.images[dark] for frame in frames]).astype(np.float32)
