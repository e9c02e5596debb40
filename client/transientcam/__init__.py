"""A camera that sees light move: range, direct and indirect light, and transients as arrays."""

from importlib.metadata import version

from transientcam.aio import AsyncCamera, AsyncStream
from transientcam.camera import Camera
from transientcam.density import density, transient
from transientcam.discovery import FoundCamera, discover
from transientcam.errors import (
    FrameTimeout,
    MissingExtra,
    ParameterError,
    ProblemError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)
from transientcam.frame import Frame
from transientcam.lease import AsyncLease, Lease
from transientcam.opening import RecordedFrame, Recording, open  # noqa: A004 - as of gzip
from transientcam.playing import player
from transientcam.stream import Stream
from transientcam.stream_state import Reconnect
from transientcam.wire import Notice, Subscription

__version__ = version("transientcam")

__all__ = [
    "AsyncCamera", "AsyncLease", "AsyncStream", "Camera", "FoundCamera", "Frame", "FrameTimeout",
    "Lease", "MissingExtra", "Notice", "ParameterError", "ProblemError", "ProtocolError",
    "Reconnect", "RecordedFrame", "Recording", "ServerUnreachable", "Stream", "StreamClosed",
    "Subscription", "TransientcamError", "__version__", "density", "discover", "open", "player",
    "transient",
]  # fmt: skip
