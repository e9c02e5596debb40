"""A look at a scene before a plan: few images at many frequencies, as quick as the scene allows."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import AppliedSequence, Capabilities, RawFrame, Sequence
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.planning.description import Seen, describe
from transientcam_server.planning.scene import SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
FRAMES: Final = 8
"""Frames of the look; what differs between them is motion."""
STEPS: Final = FRAMES + 3
"""Of a look, where the first exposure does not saturate."""
COARSE_HZ: Final = 2e6
"""Base frequency of the coarse frame, unambiguous to 75 m."""
COARSE_TAKES: Final = 4
FIRST_EXPOSURE_S: Final = 5e-4
LONGEST_EXPOSURE_S: Final = 0.02
FILLED: Final = 0.6
"""How full the brightest pixels of the look are."""
MOST_HARMONICS: Final = 16
BRIGHT_SHARE: Final = 0.999
"""Share of the pixels that nothing planned may saturate."""
_SPARE_S: Final = 10.0
_DARKER: Final = 8.0


class LookedThrough(Protocol):
    """What a look needs of a camera."""

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


@dataclass(frozen=True, slots=True)
class Looked:
    """Frames of one sequence, and how they are reconstructed."""

    recipe: Recipe
    frames: list[RawFrame]


def look_at(
    camera: LookedThrough,
    sensor: tm.noise.Sensor,
    settings: ReconstructionSettings,
    *,
    base: Sequence | None = None,
    ambient_dn_per_s: float | None = None,
    go_on: Callable[[str], None] = lambda stage: None,
) -> SceneStatistics:
    """Look at the scene before a camera.

    A coarse frame at a low frequency gives brightness, ambient light, head room and the range to
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

    def captured(sequence: Sequence, frames: int, stage: str) -> Looked:
        applied = camera.configure(capabilities.nearest(sequence))
        recipe = Recipe(applied, settings, float(sensor.highest_dn), sensor=sensor)
        camera.start()
        try:
            taken = []
            for _ in range(frames):
                go_on(stage)
                taken.append(camera.read_frame(timeout_s=_SPARE_S + 4 / applied.frame_rate_hz))
        finally:
            camera.stop()
        return Looked(recipe, taken)

    coarse_sequence = replace(
        base, base_frequency_hz=COARSE_HZ, harmonics=1, zeroth="estimated", takes=1
    )
    exposure_s = max(FIRST_EXPOSURE_S, capabilities.min_exposure_s)
    while True:
        first = captured(replace(coarse_sequence, exposure_s=exposure_s), 1, "exposure")
        brightest_dn = brightest(first.frames[0].images, sensor)
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
        replace(coarse_sequence, exposure_s=exposure_s, takes=COARSE_TAKES), 1, "coarse range"
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
    fine = captured(fine_sequence, FRAMES, "all frequencies")
    go_on("direct range")
    scene = describe(
        _seen(fine, sensor),
        settings,
        coarse=_seen(coarse, sensor),
        ambient_dn_per_s=ambient_dn_per_s,
    )
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
    assert recipe.sensor is not None  # noqa: S101 - a planner has one
    seen = _seen(Looked(recipe, [raw]), recipe.sensor, reconstructions=[found])
    scene = describe(seen, recipe.settings, ambient_dn_per_s=ambient_dn_per_s)
    if scene is None:
        raise no_light()
    return scene


def brightest(images: _Array, sensor: tm.noise.Sensor) -> float:
    """Return what the brightest pixels hold above the dark level, in DN.

    All but `BRIGHT_SHARE` of the pixels, each at the brightest of its images (N, H, W).
    """
    highest = images.max(axis=0).astype(float)
    return float(np.quantile(highest, BRIGHT_SHARE)) - sensor.dark_dn


def _seen(
    looked: Looked,
    sensor: tm.noise.Sensor,
    *,
    reconstructions: list[tm.Reconstruction] | None = None,
) -> Seen:
    recipe = looked.recipe
    found = reconstructions or [recipe.reconstruct(frame) for frame in looked.frames]
    images = np.concatenate([_modulated(frame) for frame in looked.frames])
    smoothing_px = recipe.settings.smoothing_px
    measured = [np.asarray(each.measured) for each in found]
    return Seen(
        recipe=recipe,
        sensor=sensor,
        moments=np.stack([tm.smooth(b, smoothing_px) if smoothing_px else b for b in measured]),
        single=np.mean(measured, axis=0),
        mean_dn=images.mean(axis=0) - sensor.dark_dn,
        brightest_dn=brightest(images, sensor),
        usable=images.max(axis=0) < sensor.highest_dn,
    )


def _modulated(frame: RawFrame) -> _Array:
    """Return the images of whole periods of the light: four-bucket images of all harmonics."""
    lit = [label.index for label in frame.labels if label.harmonic > 0]
    return np.asarray(frame.images[lit])
