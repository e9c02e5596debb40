"""Recordings: raw images and all that is needed to evaluate them again, in one HDF5 file."""

from transientcam_server.recording.layout import Header
from transientcam_server.recording.reader import Recording
from transientcam_server.recording.recovery import recover
from transientcam_server.recording.writer import RecordingWriter

__all__ = ["Header", "Recording", "RecordingWriter", "recover"]
