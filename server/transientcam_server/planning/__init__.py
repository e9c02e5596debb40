"""Which sequence and estimator to take: for a target accuracy, or for a budget of time.

A look at the scene (`Planner.look`) gives `SceneStatistics`, from which a `Planner` predicts noise
and bias of any sequence, and how many pixels are within a target; recommends the best for a `Goal`
(`Plan`), or returns all that no other beats.
"""

from transientcam_server.planning._front import FrontCache, front_goal
from transientcam_server.planning._looks import Looks
from transientcam_server.planning._planner import Planner, map_files
from transientcam_server.planning._prediction.takes import predict_takes, takes_of
from transientcam_server.planning._process.process import PlanningProcess
from transientcam_server.planning._process.queue import PlanningQueue, Progress, Report
from transientcam_server.planning._scene.estimation import ESTIMATORS
from transientcam_server.planning._scene.scene import Region, SceneStatistics, uniform_scene
from transientcam_server.planning._search import families
from transientcam_server.planning._search.families import SHARE, Goal, require_plannable
from transientcam_server.planning._search.pareto import flat_from, front
from transientcam_server.planning._search.plan import Plan
from transientcam_server.planning._search.search import in_words
