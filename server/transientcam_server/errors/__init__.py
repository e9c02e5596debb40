"""The errors of the server: what it raises, the kinds of problems, and how one becomes the other.

`exceptions` draws the tree of what is raised, `kinds` lists every kind of problem that a client can
be answered with, and `translation` turns errors of all packages of the project into problems.
"""

from transientcam_server.errors import _kinds as kinds
from transientcam_server.errors._exceptions import (
    AddressUnavailable,
    ClusterError,
    DamagedFrame,
    InputError,
    JobCancelled,
    MissingExtra,
    MixedVersions,
    NotARecording,
    NotConvertible,
    OriginRefused,
    Problem,
    RecordingError,
    RecordingInUse,
    SequenceConflict,
    ServerError,
    SettingsError,
    SettingsMistake,
    StorageError,
    TokenFileError,
    UnknownToken,
    invalid,
)
from transientcam_server.errors._fence import fenced
from transientcam_server.errors._kinds import ProblemKind
from transientcam_server.errors._translation import (
    ProblemDocument,
    plain,
    problem_document,
    problem_of,
    shortened,
)
