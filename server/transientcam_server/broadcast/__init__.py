"""The newest frame for every subscriber of the stream, and notices.

The `Hub` hands each frame to the `Outbox` of every client, which holds few of them for its
`Channel`s.
"""

from transientcam_server.broadcast._channel import UNNUMBERED, Channel, DroppedFrames
from transientcam_server.broadcast._hub import Hub
from transientcam_server.broadcast._outbox import Close, Delivery, Item, Outbox
