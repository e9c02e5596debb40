"""The accuracy of a camera: of the frames it captures, and of sequences it might capture."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import transientcam_moments as tm
from transientcam_driver import Truth
from transientcam_server.camera.source import Camera
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.noise import JUDGED_PIXELS, Uncertainty
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.planning import Choice, Goal, Plan, candidates, choices_on_front, plan
from transientcam_server.planning.prediction import Predictor
from transientcam_server.planning.scene import SceneStatistic, of_frame
from transientcam_server.planning.timing import ComputingTime
from transientcam_server.settings import ReconstructionSettings, SensorSettings

_Array = NDArray[Any]


class Accuracy:
    """What is known of a camera's noise, and what follows from it. Runs on workers.

    Parameters
    ----------
    camera
        A simulated one knows its sensor.
    settings
        How images become range.
    sensor
        Of a real camera.
    """

    def __init__(
        self, camera: Camera, settings: ReconstructionSettings, sensor: SensorSettings
    ) -> None:
        self._capabilities = camera.capabilities
        self.reconstruct_with(settings)
        model = sensor if camera.simulation is None else camera.simulation.sensor
        self.sensor = tm.noise.Sensor(
            gain_e_per_dn=model.gain_e_per_dn,
            full_well_e=model.full_well_e,
            read_noise_e=model.read_noise_e,
            dark_dn=model.dark_dn,
            bits=camera.capabilities.bits,
        )

    def reconstruct_with(self, settings: ReconstructionSettings) -> None:
        """Predict from now on what images become with other settings."""
        self._settings = settings
        self._computing = ComputingTime(self._capabilities, settings)

    def noise(self, recipe: Recipe, found: tm.Reconstruction) -> tm.noise.MomentNoise:
        """Return the noise of a frame's smoothed moments (m + 1, H, W)."""
        sequence = recipe.applied.sequence
        sub_phases = sequence.sub_phases
        noise = tm.noise.moment_noise(
            np.asarray(found.smoothed[0].real),
            self.sensor,
            calibration=tm.nominal_calibration(
                sequence.harmonics, sub_phases.phases_rad, sub_phases.weights, sequence.zeroth
            ),
            zeroth=sequence.zeroth,
            takes=sequence.takes,
        )
        return tm.noise.smoothed(noise, recipe.settings.smoothing_px)

    def judge(self, recipe: Recipe, found: tm.Reconstruction) -> dict[str, float] | None:
        """Return `uncertainty` as a frame's metadata have it."""
        uncertainty = self.uncertainty(recipe, found)
        return None if uncertainty is None else uncertainty.to_document()

    def uncertainty(self, recipe: Recipe, found: tm.Reconstruction) -> Uncertainty | None:
        """Predict the deviation of a frame's range from its own returns, by a sample of pixels.

        None where no pixel has a range. With another estimator than Pisarenko's it is that of
        Pisarenko's nevertheless, which is cheap enough for every frame.
        """
        seen = np.flatnonzero(np.asarray(found.has_range).ravel())
        if not seen.size:
            return None
        chosen = seen[:: max(1, seen.size // JUDGED_PIXELS)]

        def some(planes: _Array) -> _Array:
            return np.asarray(planes).reshape((planes.shape[0], -1))[:, chosen]

        returns = tm.Returns(
            some(found.returns.phase_rad),
            some(found.returns.weight),
            np.asarray(found.returns.uniform).ravel()[chosen],
            np.asarray(found.returns.count).ravel()[chosen],
        )
        noise = tm.noise.MomentNoise(some(self.noise(recipe, found).variance))
        deviation = tm.noise.return_noise(
            returns, noise, threshold=recipe.settings.return_threshold
        )
        std_m = tm.range_m(deviation.direct_phase_std_rad, recipe.base_frequency_hz)
        known = np.isfinite(std_m)
        if not known.any():
            return None
        return Uncertainty(
            float(np.median(std_m[known])),
            float(np.quantile(std_m[known], 0.9)),
            float(deviation.holds.mean()),
        )

    def statistic(
        self, recipe: Recipe, found: tm.Reconstruction, ambient_dn_per_s: float
    ) -> SceneStatistic:
        """Describe the scene of a frame.

        Raises
        ------
        Problem
            ``target-unreachable`` where the frame shows no light.
        """
        statistic = of_frame(
            found,
            self.noise(recipe, found),
            exposure_s=recipe.applied.sequence.exposure_s,
            base_frequency_hz=recipe.base_frequency_hz,
            ambient_dn_per_s=ambient_dn_per_s,
        )
        if statistic is None:
            raise Problem(
                kinds.TARGET_UNREACHABLE,
                "The current frame shows no pixel with light that does not saturate; give a scene.",
                field="scene",
                value=None,
                best=None,
            )
        return statistic

    def plan(self, goal: Goal, scene: SceneStatistic) -> Plan:
        """Recommend a sequence; see `planning.plan`."""
        return plan(goal, self._predictor(scene), self._capabilities, reconstruct_s=self._computing)

    def front(self, goal: Goal, scene: SceneStatistic) -> list[Choice]:
        """Return all sequences that no other beats, by rising time."""
        choices = candidates(
            goal, self._predictor(scene), self._capabilities, reconstruct_s=self._computing
        )
        return choices_on_front(choices, goal.leading)

    def _predictor(self, scene: SceneStatistic) -> Predictor:
        return Predictor(scene, self.sensor, self._settings)


def range_error(found: tm.Reconstruction, truth: Truth) -> dict[str, float] | None:
    """Return how far a frame's range is off the simulated truth, in m; None without any range."""
    error_m = np.abs(np.asarray(found.range_m) - truth.range_m)
    error_m = error_m[np.isfinite(error_m)]
    if not error_m.size:
        return None
    return {"median": float(np.median(error_m)), "rms": float(np.sqrt(np.mean(error_m**2)))}
