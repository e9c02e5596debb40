"""The errors of the server: what it raises, the kinds of problems, and how one becomes the other.

`exceptions` draws the tree of what is raised, `kinds` lists every kind of problem that a client can
be answered with, and `translation` turns errors of all packages of the project into problems.
"""

from transientcam_server.errors import kinds
from transientcam_server.errors.exceptions import (
    InputError,
    Problem,
    RecordingError,
    ServerError,
    SettingsError,
)

__all__ = [
    "InputError",
    "Problem",
    "RecordingError",
    "ServerError",
    "SettingsError",
    "kinds",
]
