"""Plans sequences for the scene that a camera sees. Runs on workers."""

import threading
from typing import Any

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
        self._closing = threading.Event()
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

    def plan_document(self, goal: Goal, scene: SceneStatistics) -> dict[str, Any]:
        """Return `plan` as JSON, with intervals by a bootstrap."""
        return self.plan(goal, scene).to_document()

    def front(self, goal: Goal, scene: SceneStatistics) -> list[Choice]:
        """Return all sequences that no other beats, by rising time."""
        choices = candidates(
            goal, self._predictor(scene), self._capabilities, reconstruct_s=self._computing
        )
        return choices_on_front(choices, goal.leading)

    def front_documents(self, goal: Goal, scene: SceneStatistics) -> list[dict[str, Any]]:
        """Return `front` as JSON, with intervals by a bootstrap: seconds of computing."""
        documents = []
        for choice in self.front(goal, scene):
            self._go_on()
            documents.append(choice.to_document())
        return documents

    def close(self) -> None:
        """End what is being computed: it raises Problem ``shutting-down``. From any thread."""
        self._closing.set()

    def _predictor(self, scene: SceneStatistics) -> Predictor:
        return Predictor(scene, self._sensor, self._settings, go_on=self._go_on)

    def _go_on(self) -> None:
        if self._closing.is_set():
            raise Problem(kinds.SHUTTING_DOWN, "The service is shutting down.")


def range_error(found: tm.Reconstruction, truth: Truth) -> dict[str, float] | None:
    """Return how far a frame's range is off the simulated truth, in m; None without any range."""
    error_m = np.abs(np.asarray(found.range_m) - truth.range_m)
    error_m = error_m[np.isfinite(error_m)]
    if not error_m.size:
        return None
    return {"median": float(np.median(error_m)), "rms": float(np.sqrt(np.mean(error_m**2)))}
