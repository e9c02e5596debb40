"""ESPROS TOFcam660: commands over TCP, images over UDP or TCP (docs/cameras.md).

``wire`` has the bytes, ``control`` and ``images`` the sockets, ``device`` what `TriggeredCamera`
makes a camera of. It has not been run on a device: the bytes are those that the vendor's own
client sends and accepts (epc-tofcam-toolkit 0.13.0).
"""

from transientcam_driver.tofcam660.device import DeviceOptions, Tofcam660
from transientcam_driver.tofcam660.region import FULL, Region

__all__ = ["FULL", "DeviceOptions", "Region", "Tofcam660"]
