"""The problems of recordings: unknown, unfinished, not stored, or wrongly annotated."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from transientcam_server.errors import Problem, kinds
from transientcam_server.recording import _layout as layout
from transientcam_server.recording._swmr import in_words

_log = logging.getLogger("transientcam_server.recording.problems")


def unknown(recording_id: str) -> Problem:
    """Return the problem of an id without a recording."""
    shown = recording_id[:64]
    return Problem(
        kinds.UNKNOWN_RECORDING, f"There is no recording {shown!r}.", field="recording", value=shown
    )


def unfinished(recording_id: str) -> Problem:
    """Return the problem of a recording that is still being written or recovered."""
    return Problem(
        kinds.RECORDING_UNFINISHED, f"{recording_id} is not finished.", recording=recording_id
    )


def not_stored(place: Path, error: OSError) -> Problem:
    """Return the problem of a failed write, and log the directory."""
    _log.warning("recording into %s failed: %s", place, error)
    return Problem(kinds.RECORDING_NOT_STORED, f"It could not be written: {in_words(error)}.")


def require_annotations(annotations: Mapping[str, Any]) -> None:
    """Refuse annotations that are too long or cannot be written as JSON.

    Raises Problem ``invalid-request``.
    """
    try:
        size = len(layout.encoded(annotations))
        layout.require_plain(annotations)
    except (ValueError, RecursionError):
        raise Problem(
            kinds.INVALID_REQUEST,
            "The annotations hold a value that JSON lacks, such as NaN or half a character, or "
            f"more than {layout.MAX_DEPTH} levels.",
            field="annotations",
            limit=f"JSON of at most {layout.MAX_DEPTH} levels",
        ) from None
    if size > layout.ANNOTATIONS_BYTES:
        raise Problem(
            kinds.INVALID_REQUEST,
            f"The annotations take {size} bytes as JSON.",
            field="annotations",
            value=size,
            limit=f"at most {layout.ANNOTATIONS_BYTES} bytes",
        )
