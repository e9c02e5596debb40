"""Which sequence to take: for a target accuracy, or for a budget of time.

A `Planner` describes the scene (`SceneStatistics`), predicts the accuracy of every sequence of a
grid (`Predictor`), and recommends one for a `Goal` (`Plan`), or returns all on the Pareto front.
"""

from transientcam_server.planning.choice import Choice
from transientcam_server.planning.front import FrontCache
from transientcam_server.planning.goal import Goal
from transientcam_server.planning.plan import Plan
from transientcam_server.planning.planner import Planner
from transientcam_server.planning.prediction import Predictor
from transientcam_server.planning.scene import SceneStatistics, uniform_scene

__all__ = [
    "Choice",
    "FrontCache",
    "Goal",
    "Plan",
    "Planner",
    "Predictor",
    "SceneStatistics",
    "uniform_scene",
]
