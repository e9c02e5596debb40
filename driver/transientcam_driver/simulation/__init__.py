"""A simulated AMCW lidar: a scene, a sensor, a firmware, and a cable.

The cable is a pyusb backend, so that a program reaches the simulated camera by the same code as
a real one.
"""

from transientcam_driver.simulation.explain import ExplainedEffect, Explanation
from transientcam_driver.simulation.handle import Simulation
from transientcam_driver.simulation.responses import Truth
from transientcam_driver.simulation.scene.file import SceneInfo, list_scenes

__all__ = ["ExplainedEffect", "Explanation", "SceneInfo", "Simulation", "Truth", "list_scenes"]
