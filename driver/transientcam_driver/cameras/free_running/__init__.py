"""Cameras that capture by themselves: raw exposures, or complex moments, at any frequencies.

`FreeRunningCamera` makes a `Camera` of a `FreeRunningDevice`, which only has to say what it
measures, to start, and to hand frames over.
"""

from transientcam_driver.cameras.free_running._camera import FreeRunningCamera, FreeRunningDevice
from transientcam_driver.cameras.free_running._measurement import (
    Capture,
    Description,
    Exposure,
    Moment,
)
