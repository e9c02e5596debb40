"""Emulated devices in front of a scene: what answers at the other end of the cable.

Each answers as its real one does, so that a program reaches it by the same driver.
"""

from transientcam_simulation.emulated._build import (
    DEFAULT_HEIGHT,
    DEFAULT_WIDTH,
    MEASURED,
    RESOLUTIONS,
    build,
    find_scene,
    measured_scene,
    without_noise,
    world_before,
    world_of,
)
from transientcam_simulation.emulated._handle import SimulationHandle
from transientcam_simulation.emulated._kinect2 import build_kinect2
from transientcam_simulation.emulated._open_usb import Fault, SimulatedBus, prototype
from transientcam_simulation.emulated._plugged_camera import PluggedCamera
from transientcam_simulation.emulated._tofcam660 import build_tofcam660
from transientcam_simulation.emulated._two_taps import ZERO_DN, DifferentialPixels, with_bits
