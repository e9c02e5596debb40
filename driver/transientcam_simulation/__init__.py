"""A simulated AMCW lidar: a scene, a sensor, a firmware, and a cable.

The cable is a pyusb backend, so that a program reaches the simulated camera by the same code as
a real one. The driver's camera does not import any of it; ``opening`` puts them together.
"""

from transientcam_simulation.emulated import (
    SimulationHandle,
    build,
    find_scene,
    measured_scene,
    without_noise,
    world_of,
)
from transientcam_simulation.scene import SceneInfo, list_scenes
