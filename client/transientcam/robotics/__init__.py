"""Frames as messages of robot software: images, points, lens and pose, for viewers and files.

`messages` says what is sent, independent of any format; `foxglove_messages` puts them into
Foxglove's, and `foxglove_bridge` serves them live.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
