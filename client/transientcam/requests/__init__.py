"""Requests to a daemon and the reading of their answers, without I/O.

A `Request` holds what to send and how to read the `Answer`; `Camera` and `AsyncCamera` send it.
"""

from transientcam.requests.calibrations import Calibrations
from transientcam.requests.jobs import Jobs
from transientcam.requests.request import Answer, Request, document, problem, problem_error

__all__ = [
    "Answer",
    "Calibrations",
    "Jobs",
    "Request",
    "document",
    "problem",
    "problem_error",
]
