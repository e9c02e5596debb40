"""Microsoft Kinect v2: three fixed frequencies over USB 3 (docs/cameras.md, docs/kinect2.md).

``packets`` finds sub-images in the packets of the isochronous endpoint, ``codes`` decodes them,
``measurement`` puts them in the order of a frame, ``tables`` and ``parameters`` read what the
camera knows about itself; ``encoder`` goes the other way. All of these are pure. The bytes are
those that OpenKinect/libfreenect2 accepts.
"""

from transientcam_driver.kinect2.camera import Kinect2Camera
from transientcam_driver.kinect2.device import Identity, Kinect2
from transientcam_driver.kinect2.packets import Assembler
from transientcam_driver.kinect2.parameters import DepthParameters
from transientcam_driver.kinect2.tables import P0Tables

__all__ = ["Assembler", "DepthParameters", "Identity", "Kinect2", "Kinect2Camera", "P0Tables"]
