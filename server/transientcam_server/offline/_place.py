"""Where recordings are read from: files, and those of a daemon."""

from pathlib import Path
from typing import IO, cast

from transientcam.opening import remote_recording
from transientcam_server.recording import Recording


def recording_at(place: str, *, token: str | None = None, timeout_s: float = 10.0) -> Recording:
    """Open the file at a path, or that of a daemon's recording; see `opening.open_recording`."""
    if "://" not in place:
        return Recording(Path(place))
    source = remote_recording(place, token=token, timeout_s=timeout_s)
    return Recording(Path(source.url), source=cast("IO[bytes]", source))
