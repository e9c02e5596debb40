"""Which sequence and estimator to take: for a target accuracy, or for a budget of time.

A look at the scene (`Planner.look`) gives `SceneStatistics`, from which a `Planner` predicts noise,
bias and outliers of any sequence, recommends the best for a `Goal` (`Plan`), or returns all that no
other beats.
"""

from transientcam_server.planning.front import FrontCache
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.looks import Looks
from transientcam_server.planning.plan import Plan
from transientcam_server.planning.planner import Planner
from transientcam_server.planning.progress import Progress
from transientcam_server.planning.scene import SceneStatistics, uniform_scene

__all__ = [
    "FrontCache",
    "Goal",
    "Looks",
    "Plan",
    "Planner",
    "Progress",
    "SceneStatistics",
    "uniform_scene",
]
