"""An emulated Kinect v2 in front of a simulated scene, behind the seam `kinect2.link.Link`.

``firmware`` answers requests byte by byte, ``pixels`` makes sub-images from a scene, ``device`` is
the cable: it hands over packets, loses them, and is pulled.
"""

from transientcam_simulation.emulated._kinect2.build import build_kinect2
from transientcam_simulation.emulated._kinect2.device import EmulatedKinect2
from transientcam_simulation.emulated._kinect2.firmware import EmulatedFirmware
