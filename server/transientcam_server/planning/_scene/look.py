"""A look at a scene before a plan: few images at many frequencies, as quick as the scene allows."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import AppliedSequence, Capabilities, RawFrame, Sequence
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import Recipe
from transientcam_server.planning._scene.description import (
    FrameAverages,
    describe,
    lit_pixels,
    moving_share,
)
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
FRAMES: Final = 8
"""Frames of the look at least; what differs between them is motion."""
STILL_FRAMES: Final = 32
"""And of a scene where nothing moves: what a plan calls bias is in part the noise of the look."""
STILL_SHARE: Final = 0.01
"""Share of the lit pixels that may seem to move there."""
COARSE_HZ: Final = 2e6
"""Base frequency of the coarse frame, unambiguous to 75 m."""
COARSE_FRAMES: Final = 4
STEPS: Final = 1 + COARSE_FRAMES + STILL_FRAMES + 1
"""Of a look, at most, where the first exposure does not saturate."""
FIRST_EXPOSURE_S: Final = 5e-4
LONGEST_EXPOSURE_S: Final = 0.02
FILLED: Final = 0.6
"""How full the brightest pixels of the look are."""
MOST_HARMONICS: Final = 16
_SPARE_S: Final = 10.0
_DARKER: Final = 8.0


class FrameSource(Protocol):
    """A camera, as far as a look needs it."""

    @property
    def capabilities(self) -> Capabilities:
        """Limits and size of the device."""
        ...

    def configure(self, sequence: Sequence) -> AppliedSequence:
        """Set a sequence."""
        ...

    def start(self) -> None:
        """Capture frames back to back."""
        ...

    def stop(self) -> None:
        """Capture nothing more."""
        ...

    def read_frame(self, *, timeout_s: float = 10.0) -> RawFrame:
        """Wait for the next frame."""
        ...


class _FrameSums:
    """Sums over frames of one sequence: no more than the first and the last one are kept.

    Parameters
    ----------
    recipe, sensor
        How they are captured.
    """

    def __init__(self, recipe: Recipe, sensor: tm.noise.Sensor) -> None:
        self._recipe, self._sensor = recipe, sensor
        self._frames = self._images = 0
        self._first: _Array
        self._last: _Array
        self._single: _Array = np.zeros((), np.complex64)
        self._moments: _Array = np.zeros((), np.complex64)
        self._sum_dn: _Array = np.zeros(())
        self._highest_dn: _Array = np.zeros((), np.uint16)

    def add(self, raw: RawFrame, found: tm.Reconstruction | None = None) -> None:
        """Add a frame, and its reconstruction where there is one."""
        single = np.asarray((found or self._recipe.reconstruct(raw)).measured)
        smoothing_px = self._recipe.settings.gaussian_px
        moments = tm.smooth(single, smoothing_px) if smoothing_px else single
        images = _modulated(raw)
        if not self._frames:
            self._first = moments
        self._last = moments
        self._single = self._single + single
        self._moments = self._moments + moments
        self._sum_dn = self._sum_dn + images.sum(axis=0, dtype=float)
        self._highest_dn = np.maximum(self._highest_dn, images.max(axis=0))
        self._frames += 1
        self._images += len(images)

    def averages(self) -> FrameAverages:
        """Return what the frames show so far, one at least."""
        sensor = self._sensor
        return FrameAverages(
            recipe=self._recipe,
            sensor=sensor,
            frames=self._frames,
            moments=self._moments / self._frames,
            moved=self._last - self._first,
            single=self._single / self._frames,
            mean_dn=self._sum_dn / self._images - sensor.dark_dn,
            highest_dn=self._highest_dn - sensor.dark_dn,
            usable=self._highest_dn < sensor.highest_dn,
        )


def look_at(
    camera: FrameSource,
    sensor: tm.noise.Sensor,
    settings: ReconstructionSettings,
    *,
    base: Sequence | None = None,
    ambient_dn_per_s: float | None = None,
    go_on: Callable[[str], None] = lambda stage: None,
) -> SceneStatistics:
    """Look at the scene before a camera.

    Coarse frames at a low frequency give brightness, ambient light, head room and the range to
    75 m; a fine one at half the base frequency, with harmonics up to the camera's highest
    frequency, holds the moments of every sequence whose frequencies are multiples of that.

    Parameters
    ----------
    camera
        Is left with another sequence, stopped.
    sensor
        Of the camera.
    settings
        Smoothing, biasing and threshold.
    base
        Whose base frequency, its multiples and half of it are planned with, and its sub-phases.
    ambient_dn_per_s
        Light that is not the camera's; None takes it from the mean of the images.
    go_on
        Called with the name of the stage before each frame; whatever it raises ends the look.

    Raises
    ------
    Problem
        ``target-unreachable`` where no pixel has light, or the shortest exposure saturates.
    CameraError
        As the camera does.
    """
    base = base or Sequence()
    capabilities = camera.capabilities

    def captured(
        sequence: Sequence, frames: int, stage: str, *, still_frames: int = 0
    ) -> FrameAverages:
        applied = camera.configure(capabilities.nearest(sequence))
        recipe = Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor)
        sums = _FrameSums(recipe, sensor)
        spare_s = _SPARE_S + 4 / applied.frame_rate_hz

        def take(count: int) -> FrameAverages:
            for _ in range(count):
                go_on(stage)
                sums.add(camera.read_frame(timeout_s=spare_s))
            return sums.averages()

        camera.start()
        try:
            averages = take(frames)
            if still_frames and _still(averages):
                averages = take(still_frames - frames)
        finally:
            camera.stop()
        return averages

    coarse_sequence = replace(
        base, base_frequency_hz=COARSE_HZ, harmonics=1, zeroth="estimated", takes=1
    )
    exposure_s = max(FIRST_EXPOSURE_S, capabilities.min_exposure_s)
    while True:
        first = captured(replace(coarse_sequence, exposure_s=exposure_s), 1, "exposure")
        brightest_dn = first.brightest_dn()
        if brightest_dn < sensor.brightest:
            break
        if exposure_s <= capabilities.min_exposure_s:
            raise Problem(
                kinds.TARGET_UNREACHABLE,
                f"The scene is too bright: the shortest exposure, {exposure_s:g} s, saturates.",
                field="scene",
                value=None,
                best=None,
            )
        exposure_s = max(exposure_s / _DARKER, capabilities.min_exposure_s)
    longest_s = min(LONGEST_EXPOSURE_S, capabilities.max_exposure_s)
    filling_s = exposure_s * FILLED * sensor.brightest / max(brightest_dn, 1.0)
    exposure_s = max(min(filling_s, longest_s), capabilities.min_exposure_s)
    coarse = captured(
        replace(coarse_sequence, exposure_s=exposure_s), COARSE_FRAMES, "coarse range"
    )
    fine_hz = max(base.base_frequency_hz / 2, capabilities.min_frequency_hz)
    harmonics = min(int(capabilities.max_frequency_hz / fine_hz), MOST_HARMONICS)
    fine_sequence = replace(
        base,
        base_frequency_hz=fine_hz,
        harmonics=harmonics,
        zeroth="estimated",
        takes=1,
        exposure_s=exposure_s,
    )
    fine = captured(fine_sequence, FRAMES, "all frequencies", still_frames=STILL_FRAMES)
    go_on("direct range")
    scene = describe(fine, settings, coarse=coarse, ambient_dn_per_s=ambient_dn_per_s)
    if scene is None:
        raise no_light()
    return scene


def no_light() -> Problem:
    """Return the problem of a scene that sends no light back."""
    return Problem(
        kinds.TARGET_UNREACHABLE,
        "No pixel has light that stands clear of the noise and does not saturate; give a scene.",
        field="scene",
        value=None,
        best=None,
    )


def look_of_frame(
    recipe: Recipe, found: tm.Reconstruction, raw: RawFrame, ambient_dn_per_s: float | None
) -> SceneStatistics:
    """Describe the scene that a single frame shows, as far as that resolves it.

    Parameters
    ----------
    found
        The frame's reconstruction.
    raw
        Its images.
    ambient_dn_per_s
        Light that is not the camera's; None takes it from the mean of the images.

    Raises
    ------
    Problem
        ``target-unreachable`` where no pixel has light.
    """
    if recipe.sensor is None:  # of a real camera, whose images are too dark to tell their noise
        raise no_light()
    sums = _FrameSums(recipe, recipe.sensor)
    sums.add(raw, found)
    scene = describe(sums.averages(), recipe.settings, ambient_dn_per_s=ambient_dn_per_s)
    if scene is None:
        raise no_light()
    return scene


def _still(averages: FrameAverages) -> bool:
    """Whether nothing moves that frames show."""
    lit = lit_pixels(averages)
    return bool(lit.any()) and moving_share(averages, lit) <= STILL_SHARE


def _modulated(frame: RawFrame) -> _Array:
    """Return the images of whole periods of the light: four-bucket images of all harmonics."""
    lit = [label.index for label in frame.labels if label.harmonic > 0]
    return np.asarray(frame.images[lit])
