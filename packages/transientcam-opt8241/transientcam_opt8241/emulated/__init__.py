"""An emulated OPT8241-CDK in front of a simulated scene, at the seam below its driver.

``firmware`` are its registers, ``device`` its sensor, its cable and a link at a time; its pixels
are those of ``two_taps``.
"""

from transientcam_opt8241.emulated._build import build_opt8241
from transientcam_opt8241.emulated._device import EmulatedOpt8241
from transientcam_opt8241.emulated._firmware import EmulatedRegisters
