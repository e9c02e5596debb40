"""Encodings of products: files for HTTP answers, compact messages for the stream."""

from transientcam_server.imaging._encodings.compact import stream_encoding
from transientcam_server.imaging._encodings.encoding import ENCODINGS, Encoding

__all__ = ["ENCODINGS", "Encoding", "stream_encoding"]
