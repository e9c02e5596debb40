"""The simulated camera in front of a scene, calibrated as the paper does it (Sec. 4.2, 6)."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import (
    AppliedSequence,
    Camera,
    RawFrame,
    Sequence,
    Truth,
    capture_calibration,
    open_camera,
)
from transientcam_driver.clock import VirtualClock
from transientcam_server.imaging import Calibration, Recipe, evaluate
from transientcam_server.settings import ReconstructionSettings

Array = NDArray[Any]
Options = Mapping[str, str]
"""Options in the name of a simulated camera."""
NO_OPTIONS: Final[Options] = MappingProxyType({})
WITHOUT_OUTLIERS: Final[Options] = MappingProxyType({"outliers": "off"})
"""For data "without outliers" (Fig. 12), and for comparison."""
DEVICE: Final = "prototype"
"""The model of camera: the paper's, as far as its figures are known."""
WARM_UP_S: Final = 1800.0
""""After some warm-up time" (Sec. 6.4): thermal drift has ended, and moving scenes begin anew."""
_QUICK_TAKES = 3  # the fewest in which an outlier is found
_QUICK_CALIBRATION_TAKES = 6
_CALIBRATION_TAKES = 40


@dataclass(frozen=True, slots=True, eq=False)
class ReconstructedShot:
    """One reconstructed capture, and the truth when its last image was taken.

    ``time_s`` is the device's time of the first exposure since its warm-up.
    """

    found: tm.Reconstruction
    truth: Truth
    applied: AppliedSequence
    time_s: float

    @property
    def base_frequency_hz(self) -> float:
        """Of the sequence that was really set."""
        return self.applied.sequence.base_frequency_hz

    @property
    def lit(self) -> Array:
        """Pixels (H, W) that light comes back to, directly or not."""
        return np.isfinite(self.truth.first_return_m) & (self.truth.brightness > 0)


class Bench:
    """Captures on demand, each at most once.

    ``seed``: seed of all random numbers.
    ``quick``: average fewer takes, and look at fewer points: for a first look, and for tests.
    ``waveform``: a measured correlation function for Figure 3: a .npy (rows, samples) over one
    period, opposite rows in pairs.
    """

    def __init__(self, *, seed: int = 1, quick: bool = False, waveform: Path | None = None) -> None:
        self.seed = seed
        self.quick = quick
        self.waveform = waveform
        self._calibrations: dict[tuple[Any, ...], Calibration] = {}
        self._shots: dict[tuple[Any, ...], list[ReconstructedShot]] = {}

    def few(self, full: int, quick: int) -> int:
        """Return the number of points to look at: ``full``, or ``quick`` for a first look."""
        return quick if self.quick else full

    def shot(
        self, scene: str, sequence: Sequence, *, at_s: float = 0.0, options: Options = NO_OPTIONS
    ) -> ReconstructedShot:
        """Capture once; see `shots`."""
        return self.shots(scene, sequence, at_s=at_s, options=options)[0]

    def shots(
        self,
        scene: str,
        sequence: Sequence,
        *,
        frames: int = 1,
        at_s: float = 0.0,
        options: Options = NO_OPTIONS,
    ) -> list[ReconstructedShot]:
        """Capture frames one after the other, and reconstruct them as the daemon would.

        ``scene``: a name, or the path of a .toml.
        ``at_s``: when to begin, after the warm-up.
        ``options``: further options of the camera's name, as in `WITHOUT_OUTLIERS`.
        """
        sequence = self.sequence(sequence)
        key = (scene, sequence, frames, at_s, *sorted(options.items()))
        if key not in self._shots:
            self._shots[key] = self._captured(scene, sequence, frames, at_s, options)
        return self._shots[key]

    def sequence(self, sequence: Sequence) -> Sequence:
        """Return the sequence that is really captured: with fewer takes for a first look."""
        takes = sequence.takes
        return replace(sequence, takes=min(takes, _QUICK_TAKES) if self.quick else takes)

    def raw(self, scene: str, sequence: Sequence) -> tuple[Array, Truth]:
        """Return uncalibrated images (N, H, W) of a scene with its own device, and the truth."""
        with ExitStack() as stack:
            camera = stack.enter_context(open_camera(f"sim:{scene}", clock=VirtualClock()))
            camera.configure(sequence)
            assert camera.simulation is not None  # noqa: S101 - only simulated ones are opened
            camera.start()
            images = camera.read_frame().images
            camera.stop()
            return images, camera.simulation.truth()

    def calibration(self, sequence: Sequence, *, options: Options = NO_OPTIONS) -> Calibration:
        """Return the calibration of a sequence: filter and diffuser before the lens (Fig. 4)."""
        single = replace(sequence, takes=1)
        key = (single, *sorted(options.items()))
        if key not in self._calibrations:
            with ExitStack() as stack:
                camera = self._camera(stack, "calibration", options, 0.0)
                camera.configure(single)
                takes = self.few(_CALIBRATION_TAKES, _QUICK_CALIBRATION_TAKES)
                capture = capture_calibration(camera, takes=takes, average=tm.average_takes)
            self._calibrations[key] = evaluate(capture)
        return self._calibrations[key]

    def _captured(
        self, scene: str, sequence: Sequence, frames: int, at_s: float, options: Options
    ) -> list[ReconstructedShot]:
        calibration = self.calibration(sequence, options=options)
        shots = []
        with ExitStack() as stack:
            camera = self._camera(stack, scene, options, at_s)
            applied = camera.configure(sequence)
            calibration.capture.require_fit(applied, camera.capabilities)
            full_scale = 2.0**camera.capabilities.bits - 1.0
            # "in videos we fill in data missing due to outliers" (Sec. 6)
            settings = ReconstructionSettings(
                estimator="pisarenko", neighbours="gaussian", spoilt_images="fill"
            )
            recipe = Recipe(applied, settings, full_scale, calibration.gains)
            before: RawFrame | None = None
            assert camera.simulation is not None  # noqa: S101 - only simulated ones are opened
            camera.start()
            for _ in range(frames):
                frame = camera.read_frame()
                truth = camera.simulation.truth()
                found: tm.Reconstruction = recipe.reconstruct(frame, before)
                before = frame
                shots.append(
                    ReconstructedShot(found, truth, applied, frame.device_time_s - WARM_UP_S)
                )
            camera.stop()
        return shots

    def _camera(self, stack: ExitStack, scene: str, options: Options, at_s: float) -> Camera:
        query = {"device": DEVICE, "seed": str(self.seed)} | dict(options)
        spec = f"sim:{scene}?" + "&".join(f"{name}={value}" for name, value in query.items())
        clock = VirtualClock()
        camera = stack.enter_context(open_camera(spec, clock=clock))
        clock.sleep(WARM_UP_S + at_s)
        return camera
