"""Frames as messages of robot software: images, points, lens and pose, for viewers and files.

`messages` says what is sent, independent of any format; `foxglove_messages` puts them into
Foxglove's, and `foxglove_bridge` serves them live.
"""

from transientcam.robotics.messages import (
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

__all__ = [
    "CAMERA_FRAME",
    "OPTICAL_FRAME",
    "Calibration",
    "Image",
    "Message",
    "Pinhole",
    "Points",
    "Transform",
    "messages_of",
    "viewable",
]
