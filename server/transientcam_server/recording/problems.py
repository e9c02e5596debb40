"""What is answered where a recording cannot be had, changed or stored."""

import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import Problem
from transientcam_server.recording import layout
from transientcam_server.recording.swmr import in_words

_log = logging.getLogger(__name__)


def unknown(recording_id: str) -> Problem:
    """Say that there is no such recording."""
    shown = recording_id[:64]
    return Problem(
        kinds.UNKNOWN_RECORDING, f"There is no recording {shown!r}.", field="recording", value=shown
    )


def unfinished(recording_id: str) -> Problem:
    """Say that it is still being written, or recovered."""
    return Problem(
        kinds.RECORDING_UNFINISHED, f"{recording_id} is not finished.", recording=recording_id
    )


def not_stored(place: Path, error: OSError) -> Problem:
    """Say that the disk does not take it, and log where."""
    _log.warning("recording into %s failed: %s", place, error)
    return Problem(kinds.RECORDING_NOT_STORED, f"The disk does not take it: {in_words(error)}.")


def require_annotations(annotations: Mapping[str, Any]) -> None:
    """Refuse annotations that have no place in the file, or no JSON.

    Raises
    ------
    Problem
        ``invalid-request``.
    """
    try:
        size = len(layout.encoded(annotations))
        json.dumps(annotations, ensure_ascii=False).encode()
    except (ValueError, RecursionError):
        raise Problem(
            kinds.INVALID_REQUEST,
            "The annotations hold something that JSON has not: NaN, or half a character.",
            field="annotations",
            limit="JSON",
        ) from None
    if size > layout.ANNOTATIONS_BYTES:
        raise Problem(
            kinds.INVALID_REQUEST,
            f"The annotations take {size} bytes as JSON.",
            field="annotations",
            value=size,
            limit=f"at most {layout.ANNOTATIONS_BYTES} bytes",
        )
