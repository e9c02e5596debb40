"""An emulated OPT8241-CDK in front of a simulated scene, at the seam below its driver.

``firmware`` are its registers, ``device`` its sensor, its cable and a link at a time; its pixels
are those of ``two_taps``.
"""

from transientcam_simulation.emulated._opt8241.build import build_opt8241
from transientcam_simulation.emulated._opt8241.device import EmulatedOpt8241
from transientcam_simulation.emulated._opt8241.firmware import EmulatedRegisters

__all__ = ["EmulatedOpt8241", "EmulatedRegisters", "build_opt8241"]
