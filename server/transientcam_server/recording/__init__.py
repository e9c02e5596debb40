"""Recordings: raw images and all that is needed to evaluate them again, in one HDF5 file.

`RecordingWriter` and `Recording` write and read one file, `recover` repairs one whose writer
died, `ReplayCamera` plays one as a camera. `Library` is the directory of a running service.
"""

from transientcam_server.recording.layout import Header
from transientcam_server.recording.library import Library, RecordingOptions
from transientcam_server.recording.reader import Recording
from transientcam_server.recording.recorder import Limits
from transientcam_server.recording.recovery import recover
from transientcam_server.recording.replay import ReplayCamera
from transientcam_server.recording.writer import RecordingWriter

__all__ = [
    "Header",
    "Library",
    "Limits",
    "Recording",
    "RecordingOptions",
    "RecordingWriter",
    "ReplayCamera",
    "recover",
]
