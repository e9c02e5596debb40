"""From light to raw images: exposure, the sensor, its noise and its converter."""

from transientcam_simulation.imaging._world import SwitchableWorld, World
