"""A look at a scene before a plan: few images at many frequencies, as quick as the scene allows."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Camera, RawFrame, Sequence, capture_calibration
from transientcam_driver.calibration import TemperatureDrift
from transientcam_server.errors import Problem, kinds
from transientcam_server.imaging import Gains, Recipe, evaluate
from transientcam_server.planning._scene.description import (
    FrameAverages,
    describe,
    lit_pixels,
    moving_pixels,
)
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.settings import ReconstructionSettings

_Array = NDArray[Any]
TAKES: Final = 4
"""Of a frame of the look: images that lost their synchronisation are left out."""
FRAMES: Final = 2
"""Frames of the look at least; what differs between them is motion."""
STILL_FRAMES: Final = 8
"""And of a scene where nothing moves: what a plan calls bias is in part the noise of the look."""
STILL_SHARE: Final = 0.01
"""Share of the lit pixels that may seem to move there."""
COARSE_HZ: Final = 2e6
"""Base frequency of the coarse frame, unambiguous to 75 m."""
CALIBRATION_TAKES: Final = 16
"""Of a simulated camera, through its own diffuser, where its device is not ideal."""
OF_THE_DEVICE: Final = frozenset(
    ("roll-off", "pixel-pattern", "modulation-harmonics", "thermal-drift", "outliers")
)
"""Effects that a calibration shows."""
STEPS: Final = 1 + 4 + 2 + STILL_FRAMES + 1
"""Of a look, at most, where the first exposure does not saturate."""
FIRST_EXPOSURE_S: Final = 5e-4
LONGEST_EXPOSURE_S: Final = 0.02
FILLED: Final = 0.6
"""How full the brightest pixels of the look are."""
MOST_HARMONICS: Final = 16
_SPARE_S: Final = 10.0
_COMPUTED_S: Final = 600.0
"""A simulated device takes as long as it is computed."""
_DARKER: Final = 8.0


class _FrameSums:
    """Sums over frames of one sequence: no more than the first and the last one are kept.

    Frames with images that could not be repaired are left out, unless there are no others.

    ``recipe``, ``sensor``: How they are captured.
    """

    def __init__(self, recipe: Recipe, sensor: tm.noise.Sensor) -> None:
        self._recipe, self._sensor = recipe, sensor
        self._frames = self._images = 0
        self._first: _Array
        self._last: _Array
        self._spoilt: tuple[RawFrame, tm.Reconstruction] | None = None
        self._squares: _Array = np.zeros((), np.float32)
        self._temperature_c: float | None = None
        self._single: _Array = np.zeros((), np.complex64)
        self._moments: _Array = np.zeros((), np.complex64)
        self._sum_dn: _Array = np.zeros(())
        self._highest_dn: _Array = np.zeros((), np.uint16)

    def add(self, raw: RawFrame, found: tm.Reconstruction | None = None) -> None:
        """Add a frame, and its reconstruction where there is one."""
        found = found or self._recipe.reconstruct(raw)
        self._temperature_c = raw.temperature_c
        if found.unrepaired_images:
            self._spoilt = raw, found
        else:
            self._add(raw, found)

    def _add(self, raw: RawFrame, found: tm.Reconstruction) -> None:
        single = np.asarray(found.measured)
        smoothing_px = self._recipe.settings.gaussian_px
        moments = tm.smooth(single, smoothing_px) if smoothing_px else single
        images = _modulated(raw)
        if not self._frames:
            self._first = self._last = moments
        self._squares = self._squares + np.abs(moments - self._first) ** 2
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
        if not self._frames and self._spoilt is not None:
            self._add(*self._spoilt)
        mean = self._moments / self._frames
        around = self._squares - self._frames * np.abs(mean - self._first) ** 2
        return FrameAverages(
            recipe=self._recipe,
            sensor=sensor,
            frames=self._frames,
            moments=mean,
            first=self._first,
            last=self._last,
            scatter=np.maximum(around, 0.0) / max(self._frames - 1, 1),
            temperature_c=self._temperature_c,
            single=self._single / self._frames,
            # of differences of two taps the mean is nothing, and noise still that of all light
            mean_dn=np.maximum(
                self._sum_dn / self._images - sensor.dark_dn, np.abs(mean[1:]).max(axis=0) / 2
            ),
            highest_dn=self._highest_dn - sensor.dark_dn,
            usable=self._highest_dn < sensor.highest_dn,
        )


def capture_look(
    camera: Camera,
    sensor: tm.noise.Sensor,
    settings: ReconstructionSettings,
    *,
    base: Sequence | None = None,
    ambient_dn_per_s: float | None = None,
    calibrated_c: float | None = None,
    in_use: Gains | None = None,
    go_on: Callable[[str], None] = lambda stage: None,
) -> Callable[[], SceneStatistics]:
    """Capture what shows the scene before a camera, and return what describes it.

    Coarse frames at a low frequency give brightness, ambient light, head room and the range to
    75 m; fine ones in between at half the base frequency, with harmonics up to the camera's highest
    frequency, hold the moments of every sequence whose frequencies are multiples of that. As a
    calibration fits one sequence alone, a simulated camera is calibrated for the look, by the
    diffuser that it has: plans are for a camera that is calibrated with what they recommend. Any
    other one captures its fine frames with the sequence that its calibration in use fits; without
    one nominal gains are all there is, which are no calibration.

    ``camera``: Is left with another sequence, stopped.
    ``sensor``: Of the camera.
    ``settings``: Smoothing, biasing and threshold.
    ``base``: Whose base frequency, its multiples and half of it are planned with, and its sub-
    phases.
    ``ambient_dn_per_s``: Light that is not the camera's; None takes it from the mean of the images.
    ``calibrated_c``: Temperature of the camera at the calibration in use; None where that is not
    known.
    ``in_use``: Gains that fit ``base``, of a camera that is not simulated; None without any.
    ``go_on``: Called with the name of the stage before each frame; whatever it raises ends the
    look.
    Raises Problem: ``target-unreachable`` where the shortest exposure saturates, and what is
    returned where no pixel has light.
    Raises CameraError: As the camera does.
    """
    base = base or Sequence()
    capabilities = camera.capabilities

    def captured(
        sequence: Sequence,
        frames: int,
        stage: str,
        *,
        more_if_still: int = 0,
        gains: Gains | None = None,
        more_of: _FrameSums | None = None,
    ) -> _FrameSums:
        applied = camera.configure(capabilities.nearest(sequence))
        recipe = Recipe(applied, settings, float(sensor.highest_dn), gains, sensor=sensor)
        sums = more_of or _FrameSums(recipe, sensor)
        spare_s = _SPARE_S if camera.simulation is None else _COMPUTED_S
        spare_s += 4 / applied.frame_rate_hz

        def take(count: int) -> None:
            for _ in range(count):
                go_on(stage)
                sums.add(camera.read_frame(timeout_s=spare_s))

        camera.start()
        try:
            take(frames)
            if more_if_still and _still(sums.averages()):
                take(more_if_still)
        finally:
            camera.stop()
        return sums

    def filling_s(sequence: Sequence) -> float:
        """Return the exposure that fills the brightest pixels, as far as there may be one."""
        exposure_s = max(FIRST_EXPOSURE_S, capabilities.min_exposure_s)
        while True:
            first = captured(replace(sequence, exposure_s=exposure_s), 1, "exposure")
            brightest_dn = first.averages().brightest_dn()
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
        fills_s = exposure_s * FILLED * sensor.brightest / max(brightest_dn, 1.0)
        return max(min(fills_s, longest_s), capabilities.min_exposure_s)

    def calibrated(sequence: Sequence) -> tuple[Gains | None, float]:
        """Return the gains of a simulated camera, and which share of its images it loses.

        None and 0 where it is ideal, or real.
        """
        there = camera.simulation
        if there is None or there.diffuser:
            return None, 0.0
        effects = there.explain(capabilities.nearest(sequence)).effects
        if not any(each.built for each in effects if each.effect in OF_THE_DEVICE):
            return None, 0.0
        there.change(diffuser=True)
        try:
            exposure_s = filling_s(coarse_sequence)
            camera.configure(capabilities.nearest(replace(sequence, exposure_s=exposure_s)))
            capture = capture_calibration(
                camera,
                takes=CALIBRATION_TAKES,
                average=tm.average_takes,
                progress=lambda done, total: go_on("calibration"),
            )
        finally:
            there.change(diffuser=False)
        return evaluate(capture).gains, capture.rejected_images / capture.kept.size

    coarse_sequence = replace(
        base, base_frequency_hz=COARSE_HZ, harmonics=1, zeroth="estimated", takes=1
    )
    fine_hz = max(base.base_frequency_hz / 2, capabilities.min_frequency_hz)
    harmonics = min(int(capabilities.max_frequency_hz / fine_hz), MOST_HARMONICS)
    fine_sequence = replace(
        base, base_frequency_hz=fine_hz, harmonics=harmonics, zeroth="estimated", takes=TAKES
    )
    gains, lost_share = (in_use, 0.0) if in_use else calibrated(fine_sequence)
    exposure_s = base.exposure_s if in_use else filling_s(coarse_sequence)
    # one frequency alone does not tell which image lost its synchronisation
    takes, several = (2 * TAKES, 2) if lost_share else (TAKES, 1)
    coarse_sequence = replace(coarse_sequence, exposure_s=exposure_s, takes=takes)
    fine_sequence = replace(fine_sequence, exposure_s=exposure_s)
    if in_use:
        fine_sequence = replace(base, takes=TAKES)
    quick_sequence = replace(
        coarse_sequence, base_frequency_hz=2 * fine_hz, harmonics=several, takes=1
    )
    quick = [captured(quick_sequence, 2, "motion").averages()]
    coarse = captured(coarse_sequence, 1, "coarse range")
    sums = captured(fine_sequence, 1, "all frequencies", gains=gains)
    quick.append(captured(quick_sequence, 2, "motion").averages())
    captured(
        fine_sequence,
        FRAMES - 1,
        "all frequencies",
        more_if_still=STILL_FRAMES - FRAMES,
        more_of=sums,
    )
    fine = replace(sums.averages(), ideal=gains is None and camera.simulation is not None)
    captured(coarse_sequence, 1, "coarse range", more_of=coarse)
    moves = not _still(fine)
    if moves:
        quick.append(captured(quick_sequence, 2, "motion").averages())
    gain_noise = 0.0 if gains is None else TAKES / CALIBRATION_TAKES
    of_motion = quick if moves else ()

    def described() -> SceneStatistics:
        go_on("direct range")
        scene = describe(
            fine,
            settings,
            coarse=coarse.averages(),
            ambient_dn_per_s=ambient_dn_per_s,
            gain_noise=gain_noise,
            quick=of_motion,
        )
        if scene is None:
            raise no_light()
        drift_m = _drift_m(calibrated_c, fine.temperature_c)
        return replace(scene, drift_m=drift_m, lost_share=lost_share)

    return described


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

    ``found``: The frame's reconstruction.
    ``raw``: Its images.
    ``ambient_dn_per_s``: Light that is not the camera's; None takes it from the mean of the images.
    Raises Problem: ``target-unreachable`` where no pixel has light.
    """
    if recipe.sensor is None:  # of a real camera, whose images are too dark to tell their noise
        raise no_light()
    sums = _FrameSums(recipe, recipe.sensor)
    sums.add(raw, found)
    scene = describe(sums.averages(), recipe.settings, ambient_dn_per_s=ambient_dn_per_s)
    if scene is None:
        raise no_light()
    then_c = None if recipe.gains is None else recipe.gains.temperature_c
    return replace(scene, drift_m=_drift_m(then_c, raw.temperature_c), of_one_frame=True)


def _drift_m(then_c: float | None, now_c: float | None) -> float:
    """Return by how much ranges may have drifted since the calibration, without a sign."""
    drift = TemperatureDrift.between(then_c, now_c)
    return 0.0 if drift is None else drift.range_m


def _still(averages: FrameAverages) -> bool:
    """Whether nothing moves that frames show."""
    lit = lit_pixels(averages)
    return bool(lit.any()) and float(moving_pixels(averages)[lit].mean()) <= STILL_SHARE


def _modulated(frame: RawFrame) -> _Array:
    """Return the images of whole periods of the light: four-bucket images of all harmonics."""
    lit = [label.index for label in frame.labels if label.harmonic > 0]
    return np.asarray(frame.images[lit])
