"""Requests for recordings."""

from collections.abc import Mapping
from typing import Any, Final

from transientcam.requests._request import Request, document, segment

_WRITTEN_S: Final = 60.0
"""How much longer than usual it takes until all of a recording is on the disk."""


def record(
    *,
    name: str | None,
    duration_s: float | None,
    frames: int | None,
    history_s: float | None,
    annotations: Mapping[str, Any] | None,
) -> Request[dict[str, Any]]:
    """Build the request that starts a recording."""
    options = {
        "name": name,
        "duration_s": duration_s,
        "frames": frames,
        "history_s": history_s,
        "annotations": None if annotations is None else dict(annotations),
    }
    body = {key: value for key, value in options.items() if value is not None}
    return document("recordings", method="POST", body=body)


def all_recordings() -> Request[dict[str, Any]]:
    """Build the request for the list of recordings."""
    return document("recordings")


def describe(recording_id: str) -> Request[dict[str, Any]]:
    """Build the request for the description of a recording."""
    return document(recording_path(recording_id))


def stop(recording_id: str) -> Request[dict[str, Any]]:
    """Build the request that ends a recording, answered once it is on the disk."""
    path = f"{recording_path(recording_id)}/stop"
    return document(path, method="POST", extra_timeout_s=_WRITTEN_S)


def timeline(recording_id: str) -> Request[dict[str, Any]]:
    """Build the request for which frames a recording has, and when they were captured."""
    return document(f"{recording_path(recording_id)}/frames")


def recording_file(recording_id: str) -> str:
    """Return the path of a recording's file."""
    return recording_path(recording_id) + "/file"


def recording_path(recording_id: str) -> str:
    """Return the path of a recording.

    Raises
    ------
    ParameterError
        If ``recording_id`` is no id.
    """
    return f"recordings/{segment(recording_id)}"
