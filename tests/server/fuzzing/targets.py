"""The parsers of untrusted bytes: each takes any, and raises only what its docstring says."""

import contextlib
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

from transientcam import wire
from transientcam.errors import ProtocolError
from transientcam_driver.calibration import CalibrationCapture
from transientcam_driver.errors import CalibrationError
from transientcam_server.api import _downloads as downloads
from transientcam_server.errors import Problem

SMALL_BYTES: Final = 1024 * 1024


def client_message(data: bytes) -> None:
    """Read a message of a client of the stream."""
    with contextlib.suppress(ProtocolError):
        wire.parse_client_message(data)


def server_message(data: bytes) -> None:
    """Read a message of a server, frames included."""
    with contextlib.suppress(ProtocolError):
        wire.parse_server_message(data)


def calibration_file(data: bytes) -> None:
    """Read an uploaded calibration."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "upload.npz"
        path.write_bytes(data)
        with contextlib.suppress(CalibrationError):
            CalibrationCapture.load(path, max_bytes=SMALL_BYTES)


def byte_range(data: bytes) -> None:
    """Read the Range header of a download of 1000 bytes."""
    with contextlib.suppress(Problem):
        downloads._span(data.decode("latin-1"), 1000)


TARGETS: Final[dict[str, Callable[[bytes], None]]] = {
    each.__name__: each for each in (client_message, server_message, calibration_file, byte_range)
}
"""All of them, by name."""
