"""Cameras that expose when the host asks for it: the light is on for no longer than that.

`TriggeredCamera` makes a `Camera` of a `TriggeredDevice`, which only has to set a frequency, to
expose, and to hand images over.
"""

from transientcam_driver.cameras.triggered._camera import TriggeredCamera
from transientcam_driver.cameras.triggered._device import Group, Images, TriggeredDevice
