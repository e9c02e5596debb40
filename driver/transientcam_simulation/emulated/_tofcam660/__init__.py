"""An emulated TOFcam660 in front of a simulated scene, reached over real sockets.

``firmware`` answers commands, ``network`` are its sockets; its pixels are those of ``two_taps``.
"""

from transientcam_simulation.emulated._tofcam660.build import build_tofcam660
from transientcam_simulation.emulated._tofcam660.firmware import EmulatedFirmware
from transientcam_simulation.emulated._tofcam660.network import EmulatedTofcam660
