"""The newest frame for every subscriber of the stream, and notices.

The `Hub` hands each frame to the `Outbox` of every client, which holds few of them for its
`Channel`s.
"""

from transientcam_server.broadcast.channel import Channel
from transientcam_server.broadcast.hub import Hub
from transientcam_server.broadcast.outbox import Outbox

__all__ = ["Channel", "Hub", "Outbox"]
