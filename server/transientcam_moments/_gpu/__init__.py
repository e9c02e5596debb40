"""Frames on a GPU: shaders traced from the statements, and the process that runs them."""

from transientcam_moments._gpu._device import SOFTWARE, Adapter
from transientcam_moments._gpu._host import CHOICE, Choice, Device, DeviceState, Race, device_of
from transientcam_moments._gpu._passes import DevicePass
