"""Frames as messages of robot software: images, points, lens and pose, for viewers and files.

`messages` says what is sent, independent of any format; `foxglove_messages` puts them into
Foxglove's, and `foxglove_bridge` serves them live.
"""

from transientcam.robotics._foxglove_bridge import SHOWN, FoxgloveBridge
from transientcam.robotics._foxglove_messages import Encoded
from transientcam.robotics._messages import (
    CAMERA_FRAME,
    OPTICAL_FRAME,
    Calibration,
    Image,
    Message,
    Pinhole,
    Points,
    Transform,
    messages_of,
    viewable,
)
from transientcam.robotics._reports import Report
from transientcam.robotics._rerun_bridge import BINS, LOGGED, RerunBridge
from transientcam.robotics._rerun_messages import blueprint

__all__ = [
    "BINS",
    "CAMERA_FRAME",
    "LOGGED",
    "OPTICAL_FRAME",
    "SHOWN",
    "Calibration",
    "Encoded",
    "FoxgloveBridge",
    "Image",
    "Message",
    "Pinhole",
    "Points",
    "Report",
    "RerunBridge",
    "Transform",
    "blueprint",
    "messages_of",
    "viewable",
]
