"""Looks at simulated scenes."""

from transientcam_driver import Sequence, open_camera
from transientcam_driver.clock import VirtualClock
from transientcam_server.camera import sensor_of
from transientcam_server.planning import Planner, SceneStatistics
from transientcam_server.settings import ReconstructionSettings, SensorSettings

SETTINGS = ReconstructionSettings()
SCENE = """
name = "stage"
description = "A panel before nothing"
seed = 3
[camera]
position_m = [0.0, 0.0, 0.0]
look_at_m = [0.0, 2.0, 0.0]
field_of_view_deg = 40.0
[light]
position_m = [0.05, 0.0, 0.0]
aim_at_m = [0.0, 2.0, 0.0]
electrons_per_s = {light}
[ambient]
electrons_per_s = {ambient}
[[surface]]
name = "panel"
kind = "diffuse"
centre_m = [0.0, {away_m}, 0.0]
normal = [0.0, -1.0, 0.0]
size_m = [{width_m}, {width_m}]
albedo = 0.8
"""


def looked(spec: str) -> tuple[Planner, SceneStatistics]:
    clock = VirtualClock()
    with open_camera(spec, clock=clock) as camera:
        planner = Planner(camera.capabilities, sensor_of(camera, SensorSettings()), SETTINGS)
        return planner, planner.look(camera, Sequence())
