"""Plans sequences for the scene that a camera sees. Runs in `PlanningProcess`."""

import io
import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

import transientcam_moments as tm
from transientcam.notebook import palette
from transientcam_driver import Camera, Capabilities, Sequence, Truth
from transientcam_server.planning._prediction.prediction import Predictor
from transientcam_server.planning._prediction.timing import computing_s
from transientcam_server.planning._process.queue import Progress
from transientcam_server.planning._scene.look import STEPS, capture_look
from transientcam_server.planning._scene.scene import SceneStatistics
from transientcam_server.planning._search.families import (
    ComputingTime,
    Goal,
    families,
    require_plannable,
)
from transientcam_server.planning._search.plan import Plan, plan
from transientcam_server.planning._search.search import Choice, curves
from transientcam_server.planning._search.tradeoff import fronts, lines, tradeoff_document
from transientcam_server.settings import ReconstructionSettings

_AROUND_PX: Final = 3


def error_map(
    amplification_m: NDArray[Any], bias_m: NDArray[Any], noise: NDArray[Any]
) -> NDArray[np.float32]:
    """Return noise and bias together of each pixel (H, W) in m; NaN where either is not known.

    ``amplification_m``: (H, W) deviation of the range over ``noise``, by few draws; neighbours have
    nearly the same, and their geometric mean is known better.
    ``bias_m``, ``noise``: (H, W) of the range in m, and of the moments over the light.
    """
    there = np.isfinite(amplification_m) & (amplification_m > 0)
    log = np.log(amplification_m, where=there, out=np.zeros_like(amplification_m))
    count = uniform_filter(there.astype(float), _AROUND_PX)
    mean = uniform_filter(log, _AROUND_PX) / np.maximum(count, 1e-9)
    error_m = np.hypot(np.exp(mean) * noise, bias_m)
    return np.where(there & np.isfinite(bias_m), error_m, np.nan).astype(np.float32)


def map_files(error_m: NDArray[Any], target_m: float | None) -> dict[str, bytes]:
    """Return errors (H, W) in m by format: ``npy`` has the values, and ``png`` colours for eyes.

    They go from dark at 0 over their middle at the target to the brightest at twice that, or at the
    worst pixel of twenty; grey is where no light is.
    """
    from PIL import Image  # 60 ms that no other plan need wait for

    values, picture = io.BytesIO(), io.BytesIO()
    np.save(values, error_m)
    known = error_m[np.isfinite(error_m)]
    most_m = 2 * target_m if target_m else float(np.quantile(known, 0.95)) if known.size else 1.0
    index = 1.0 + 254.0 * np.clip(np.nan_to_num(error_m, nan=0.0) / max(most_m, 1e-12), 0.0, 1.0)
    image = Image.fromarray(np.where(np.isfinite(error_m), index, 0).astype(np.uint8), mode="P")
    image.putpalette(palette())
    image.save(picture, format="PNG")
    return {"npy": values.getvalue(), "png": picture.getvalue()}


class Planner:
    """Recommends sequences from the noise of one sensor and one way to reconstruct.

    ``capabilities``: Of the camera.
    ``sensor``: Whose noise its images have.
    ``settings``: Of the reconstruction.
    """

    def __init__(
        self, capabilities: Capabilities, sensor: tm.noise.Sensor, settings: ReconstructionSettings
    ) -> None:
        self._capabilities = capabilities
        self._sensor = sensor
        self._settings = settings

    def reconstruct_with(self, settings: ReconstructionSettings) -> None:
        """Predict with other settings of the reconstruction from now on."""
        self._settings = settings

    def look(self, camera: Camera, base: Sequence, **how: Any) -> SceneStatistics:
        """Look at the scene before a camera; arguments as of `capture_look`."""
        return self.capture_look(camera, base, **how)()

    def capture_look(
        self, camera: Camera, base: Sequence, *, progress: Progress | None = None, **how: Any
    ) -> Callable[[], SceneStatistics]:
        """Capture a look, and return what describes the scene: seconds without the camera.

        ``how``: What is known of light and calibration, as `look.capture_look` has it.
        """
        shown = progress or Progress()
        done = itertools.count()

        def go_on(stage: str) -> None:
            shown.at(min(next(done) / STEPS, 1.0), stage)

        return capture_look(camera, self._sensor, self._settings, base=base, go_on=go_on, **how)

    def require_possible(self) -> None:
        """Refuse a camera whose captures are not predicted (Problem ``target-unreachable``)."""
        require_plannable(self._capabilities)

    def plan(self, goal: Goal, scene: SceneStatistics, progress: Progress | None = None) -> Plan:
        """Recommend a sequence; see `planning.plan`. What is raised by ``progress`` ends it."""
        progress, predictor, timed = self._prepared(goal, progress)
        scene, camera = scene.within(goal.region), self._capabilities
        brighter = scene.brighter(2.0)
        faster = replace(camera, streaming_readout_s=camera.streaming_readout_s / 2)
        present = predictor(scene)
        better = {"readout": (present, faster), "light": (predictor(brighter), camera)}
        return plan(goal, present, camera, timed=timed, better=better, progress=progress)

    def plan_document(
        self, goal: Goal, scene: SceneStatistics, progress: Progress | None = None
    ) -> dict[str, Any]:
        """Return `plan` as JSON."""
        return self.plan(goal, scene, progress).to_document()

    def map_m(
        self,
        scene: SceneStatistics,
        estimator: str,
        sequence: Sequence,
        progress: Progress | None = None,
    ) -> NDArray[np.float32]:
        """Predict the error of each pixel (H, W) in m, noise and bias together; NaN if not lit.

        Raises Problem: ``invalid-request`` for a scene that is given, which has no pixels.
        """
        progress = progress or Progress()
        progress.at(0.0, "error of each pixel")
        every = scene.within(None, every=True)
        predictor = Predictor(every, self._sensor, self._settings, go_on=progress, closely=True)
        found = predictor.of_each(estimator, sequence)
        planes = np.full((len(found), *every.shape), np.nan)
        planes.reshape((len(found), -1))[:, every.pixels] = found
        return error_map(*planes)

    def tradeoff_document(
        self, goal: Goal, scene: SceneStatistics, progress: Progress | None = None
    ) -> dict[str, Any]:
        """Return all that no other beats, and the lines they lie on, as JSON: seconds of work.

        ``progress`` shows the same document, without lines, after each point of the front; what it
        raises ends the work.
        """
        progress, predicting, timed = self._prepared(goal, progress)
        predictor, camera = predicting(scene.within(goal.region)), self._capabilities
        found, scene = families(goal, predictor, camera, timed), predictor.scene
        candidates = curves(found, goal, predictor, camera, timed)
        choices: list[Choice] = []
        for choices in fronts(candidates, goal.leading, progress.part(0.0, 0.8)):
            progress.show(tradeoff_document(choices, [], scene))
        progress.at(0.8, "lines")
        return tradeoff_document(choices, lines(candidates, choices), scene)

    def _prepared(
        self, goal: Goal, progress: Progress | None
    ) -> tuple[Progress, Callable[[SceneStatistics], Predictor], ComputingTime]:
        """Return the progress, begun, what predicts for a scene, and what times frames.

        A budget of computing time needs kernels that are compiled.
        """
        progress = progress or Progress()
        progress.at(0.0, "sequences for the goal")
        how: dict[str, Any] = {"sensor": self._sensor, "settings": self._settings}
        predictor = partial(Predictor, **how, go_on=progress, share=goal.share)
        compiling = None if goal.computing_share is None else partial(progress.at, 0.0)
        settings = self._settings.model_dump_json()
        return progress, predictor, partial(computing_s, self._capabilities, settings, compiling)


def range_error(found: tm.Reconstruction, truth: Truth) -> dict[str, float] | None:
    """Return how far lit pixels' range is off the simulated truth, in m; None without any range."""
    error_m = np.abs(np.asarray(found.range_m) - truth.range_m)
    unlit = np.isfinite(error_m) & ~truth.lit
    error_m = error_m[np.isfinite(error_m) & truth.lit]
    if not error_m.size:
        return None
    return {
        "median": float(np.median(error_m)),
        "rms": float(np.sqrt(np.mean(error_m**2))),
        "no_direct_light_share": float(unlit.mean()),
    }
