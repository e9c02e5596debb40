"""The verb ``plan`` in this process: a look through a camera, and the search."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import transientcam_moments as tm
from transientcam.cli.terminal import Terminal
from transientcam_driver import Camera, open_camera
from transientcam_driver.clock import RealClock, VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.errors import Problem
from transientcam_server.planning import (
    Goal,
    Planner,
    Progress,
    Report,
    SceneStatistics,
    map_files,
    predict_takes,
    require_plannable,
    uniform_scene,
)
from transientcam_server.settings import ReconstructionSettings, SensorSettings

LOOK_S: Final = 60.0
"""How long a frame may take of a camera that is not planned for: an emulated one computes it."""


@dataclass(frozen=True, slots=True)
class View:
    """The camera, and what is known of the scene before it."""

    camera: str
    """As `open_camera` takes it."""
    real_time: bool
    """Whether a simulated one takes its time, too."""
    brightness_dn_per_s: float | None
    """Zeroth moment of equal pixels in DN for each second of exposure; None looks at the scene."""
    returns: list[tuple[float, float]]
    """Range in m and weight of each return of such a scene."""
    ambient_dn_per_s: float | None
    """Light that is not the camera's; None measures it."""


def by_camera(
    view: View, goal: Goal, console: Terminal, map_file: Path | None = None, *, front: bool = False
) -> tuple[dict[str, Any], bytes]:
    """Plan for a goal, or find the ``front`` of all that no other beats; as JSON, and the map.

    ``map_file``: whose format a map is to have; None for none.
    Raises Problem where the goal is out of reach, or the camera is not planned for; then with
    ``takes``, what more of them give. Raises CameraError as the camera does.
    """
    if not front:
        goal.require_sensible()
    virtual = view.camera.startswith("sim:") and not view.real_time
    clock = VirtualClock() if virtual else RealClock()
    tm.kernels.load(("likelihood",), 1)
    # to load the others takes as long as they would save
    with tm.kernels.only_note(), open_camera(view.camera, clock=clock) as camera:
        sensor = sensor_of(camera, SensorSettings())
        try:
            require_plannable(camera.capabilities)
        except Problem as problem:
            with console.status("looking at the scene"):
                predicted = predict_takes(camera, sensor, read_s=LOOK_S)
            problem.extensions["takes"] = [asdict(each) for each in predicted]
            raise
        fixed = {name: goal.base.to_document()[name] for name in goal.fixed}
        goal = replace(goal, base=camera.capabilities.sequence_of(fixed))
        planner = Planner(camera.capabilities, sensor, ReconstructionSettings())
        scene = _scene(planner, camera, view, goal, console)
    with tm.kernels.only_note(), console.status("predicting") as status:
        progress = Progress(_shown(status.update))
        if front:
            return planner.tradeoff_document(goal, scene, progress), b""
        found = planner.plan(goal, scene, progress)
        if map_file is None:
            return found.to_document(), b""
        best = found.recommended
        error_m = planner.map_m(scene, best.estimator, best.applied.sequence, progress)
        return found.to_document(), map_files(error_m, goal.range_error_m)[map_file.suffix[1:]]


def _scene(
    planner: Planner, camera: Camera, view: View, goal: Goal, console: Terminal
) -> SceneStatistics:
    """Look at the scene, and show how far that has come; or take it as it is given."""
    if view.brightness_dn_per_s is not None:
        ambient_dn_per_s = view.ambient_dn_per_s or 0.0
        return uniform_scene(
            view.brightness_dn_per_s, view.returns, ambient_dn_per_s=ambient_dn_per_s
        )
    with console.status("looking at the scene") as status:
        return planner.look(
            camera,
            goal.base,
            ambient_dn_per_s=view.ambient_dn_per_s,
            progress=Progress(_shown(status.update)),
        )


def _shown(show: Callable[[str], None]) -> Report:
    """Return what shows how far a look or a plan has come."""
    return lambda share, step: show(f"{share:.0%}: {step}")
