"""Requests to a daemon and the reading of their answers, without I/O.

A `Request` holds what to send and how to read the `Answer`; `Camera` and `AsyncCamera` send it.
"""

from transientcam.requests import _frames as frames, _planning as planning
from transientcam.requests._calibrations import Calibrations
from transientcam.requests._frames import Part, Which
from transientcam.requests._jobs import PROGRESS_EVERY_S, WAIT_S, Jobs, OnProgress, ended
from transientcam.requests._request import (
    MOST_DOCUMENT_BYTES,
    Answer,
    Request,
    document,
    given,
    problem,
    problem_error,
    recording_path,
)
