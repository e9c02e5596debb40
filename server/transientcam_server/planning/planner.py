"""Plans sequences for the scene that a camera sees. Runs on workers."""

import numpy as np

import transientcam_moments as tm
from transientcam_driver import Capabilities, Truth
from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.imaging.noise import moment_noise
from transientcam_server.imaging.recipe import Recipe
from transientcam_server.planning.candidates import candidates
from transientcam_server.planning.choice import Choice, choices_on_front
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.plan import Plan, plan
from transientcam_server.planning.prediction import Predictor
from transientcam_server.planning.scene import SceneStatistics, scene_of_frame
from transientcam_server.planning.timing import ReconstructionTimer
from transientcam_server.settings import ReconstructionSettings


class Planner:
    """Recommends sequences from the noise of one sensor and one way to reconstruct.

    Parameters
    ----------
    capabilities
        Of the camera.
    sensor
        Whose noise its images have.
    settings
        Of the reconstruction.
    """

    def __init__(
        self, capabilities: Capabilities, sensor: tm.noise.Sensor, settings: ReconstructionSettings
    ) -> None:
        self._capabilities = capabilities
        self._sensor = sensor
        self.reconstruct_with(settings)

    def reconstruct_with(self, settings: ReconstructionSettings) -> None:
        """Predict with other settings of the reconstruction from now on."""
        self._settings = settings
        self._computing = ReconstructionTimer(self._capabilities, settings)

    def scene_statistics(
        self, recipe: Recipe, found: tm.Reconstruction, ambient_dn_per_s: float
    ) -> SceneStatistics:
        """Describe the scene of a frame.

        Raises
        ------
        Problem
            ``target-unreachable`` where the frame shows no light.
        """
        statistics = scene_of_frame(
            found,
            moment_noise(recipe, found),
            exposure_s=recipe.applied.sequence.exposure_s,
            base_frequency_hz=recipe.base_frequency_hz,
            ambient_dn_per_s=ambient_dn_per_s,
        )
        if statistics is None:
            raise Problem(
                kinds.TARGET_UNREACHABLE,
                "The current frame shows no pixel with light that does not saturate; give a scene.",
                field="scene",
                value=None,
                best=None,
            )
        return statistics

    def plan(self, goal: Goal, scene: SceneStatistics) -> Plan:
        """Recommend a sequence; see `planning.plan`."""
        return plan(goal, self._predictor(scene), self._capabilities, reconstruct_s=self._computing)

    def front(self, goal: Goal, scene: SceneStatistics) -> list[Choice]:
        """Return all sequences that no other beats, by rising time."""
        choices = candidates(
            goal, self._predictor(scene), self._capabilities, reconstruct_s=self._computing
        )
        return choices_on_front(choices, goal.leading)

    def _predictor(self, scene: SceneStatistics) -> Predictor:
        return Predictor(scene, self._sensor, self._settings)


def range_error(found: tm.Reconstruction, truth: Truth) -> dict[str, float] | None:
    """Return how far a frame's range is off the simulated truth, in m; None without any range."""
    error_m = np.abs(np.asarray(found.range_m) - truth.range_m)
    error_m = error_m[np.isfinite(error_m)]
    if not error_m.size:
        return None
    return {"median": float(np.median(error_m)), "rms": float(np.sqrt(np.mean(error_m**2)))}
