"""An emulated TOFcam660 in front of a simulated scene, reached over real sockets.

``firmware`` answers commands, ``pixels`` makes its images from a scene, ``network`` are its
sockets, ``handle`` what a simulated camera offers beside its frames.
"""

from transientcam_driver.simulation.tofcam660.build import build_tofcam660
from transientcam_driver.simulation.tofcam660.firmware import EmulatedFirmware
from transientcam_driver.simulation.tofcam660.network import EmulatedTofcam660
from transientcam_driver.simulation.tofcam660.pixels import DifferentialPixels

__all__ = ["DifferentialPixels", "EmulatedFirmware", "EmulatedTofcam660", "build_tofcam660"]
