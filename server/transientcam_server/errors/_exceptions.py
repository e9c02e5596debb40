"""Everything this package raises; over HTTP and the stream each is an RFC 9457 problem.

::

    ServerError
    ├── SettingsError        a setting cannot be used; names where it was given
    ├── AddressUnavailable   the address cannot be listened on
    ├── MissingExtra         an optional feature is requested whose packages are not installed
    ├── InputError           a file given to `transientcam reconstruct` cannot be used
    ├── RecordingError       something about a recording
    │   ├── NotARecording    a file cannot be read as one
    │   ├── DamagedFrame     a frame's bytes are not the ones that were written
    │   ├── RecordingInUse   an unfinished recording is being written, recovered or deleted
    │   └── NotConvertible   a suffix names no format that something is written in
    ├── ClusterError         a cluster cannot be reached, or gave up
    ├── MixedVersions        a worker of a cluster has another version of a package
    ├── TokenFileError       the file of tokens cannot be read or written
    ├── UnknownToken         no token has this id
    ├── JobCancelled         a client cancelled a job
    ├── OriginRefused        the service that is relayed refuses a change (a `CameraError`, too)
    ├── SequenceConflict     the running sequence is not the one that a change was made for
    └── Problem              a request cannot be answered; see `transientcam_server.api._problems`

Errors of the driver and of the arithmetic become problems in one place,
`transientcam_server.errors._translation.problem_of`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from transientcam_driver import AppliedSequence, CameraError
from transientcam_driver.errors import StatedError
from transientcam_server.errors._kinds import INVALID_REQUEST, ProblemKind


class ServerError(Exception):
    """Root of all errors of this package; most state their data."""


@dataclass(frozen=True, slots=True)
class SettingsMistake:
    """One setting that cannot be used: where it was given, and what it should be."""

    place: str
    value: object
    reason: str

    def __str__(self) -> str:
        return f"{self.place}: {self.reason} (given: {self.value!r})"


class SettingsError(ServerError, StatedError):
    """Settings cannot be used; ``mistakes`` lists every one of them with its place."""

    mistakes: Sequence[SettingsMistake]

    def __str__(self) -> str:
        return "\n".join(str(mistake) for mistake in self.mistakes)


class AddressUnavailable(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """The address cannot be listened on."""

    host: str
    port: int
    reason: str
    _sentence = "cannot listen on {host}, port {port}: {reason}"


class MissingExtra(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """An optional feature was requested whose packages are not installed."""

    what: str
    module: str
    extra: str
    _sentence = "{what} needs {module}: pip install 'transientcam[{extra}]'"


class InputError(ServerError, StatedError):
    """A measurement cannot be reconstructed: ``key`` of ``file`` is ``found``, not ``expected``."""

    file: str
    key: str
    found: str
    expected: str
    _sentence = "{file}: {key} is {found}, but must be {expected}"


class RecordingError(ServerError):
    """Something about a recording."""


class NotARecording(RecordingError, StatedError):  # noqa: N818 - says what is wrong
    """A file cannot be read as a recording."""

    file: str
    reason: str
    _sentence = "{file} is no recording that can be read: {reason}"


class DamagedFrame(RecordingError, StatedError):  # noqa: N818 - says what is wrong
    """The bytes of a frame (its number, from 1) are not the ones that were written."""

    file: str
    frame: int
    reason: str
    _sentence = "{file}: frame {frame} is damaged: {reason}"


class RecordingInUse(RecordingError, StatedError):  # noqa: N818 - says what is wrong
    """An unfinished recording is being written, recovered or deleted by another service."""

    file: str
    _sentence = "{file} is being written, recovered or deleted by another program"


class NotConvertible(RecordingError, StatedError):  # noqa: N818 - says what is wrong
    """A file's suffix names no format that ``what`` is written in."""

    file: str
    known: Sequence[str]
    what: str

    def __str__(self) -> str:
        return f"{self.file}: the suffix must be one that {self.what} are written as: " + ", ".join(
            self.known
        )


class ClusterError(ServerError, StatedError):
    """A cluster cannot be reached, or gave up; what it has written stays."""

    address: str
    reason: str
    _sentence = "the cluster {address} failed: {reason}; the same command goes on where it stopped"


class StorageError(ServerError, StatedError):
    """What is behind an address cannot be read or written; ``address`` has bucket and key."""

    address: str
    reason: str
    _sentence = "{address} cannot be read or written: {reason}"


class MixedVersions(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """A worker would compute otherwise: ``found`` of ``package`` instead of ``wanted``."""

    worker: str
    package: str
    found: str
    wanted: str
    _sentence = "the worker {worker} has {package} {found}, and not {wanted} as this process"


class TokenFileError(ServerError, StatedError):
    """The file of tokens cannot be read or written."""

    file: str
    reason: str
    _sentence = "the tokens in {file} cannot be used: {reason}"


class UnknownToken(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """No token has this id."""

    token_id: str
    file: str
    _sentence = "{file} has no token {token_id}"


class JobCancelled(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """A client cancelled a job."""

    job_id: str
    _sentence = "the job {job_id} was cancelled"


class SequenceConflict(ServerError, StatedError):  # noqa: N818 - says what is wrong
    """The sequence was changed since; ``running`` is the one that runs now."""

    running: AppliedSequence
    _sentence = "the running sequence has epoch {running.epoch}"


class OriginRefused(ServerError, CameraError, StatedError):  # noqa: N818 - says what is wrong
    """The service at ``url``, which is relayed, refuses a change with this problem document."""

    url: str
    problem: Mapping[str, object]

    def __str__(self) -> str:
        return f"the origin {self.url} refuses: {self.problem.get('detail', 'it gives no reason')}"


class Problem(ServerError):  # noqa: N818 - RFC 9457 calls it so
    """A request that cannot be answered.

    ``kind``: what sort of problem, with its HTTP status and its page.
    ``detail``: one sentence about this occurrence.
    ``extensions``: what a program may want to read: mostly ``field``, ``value`` and ``limit``.
    """

    def __init__(self, kind: ProblemKind, detail: str, **extensions: object) -> None:
        super().__init__(kind.slug, detail)
        self.kind = kind
        self.detail = detail
        self.extensions = extensions

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle it by its arguments."""
        return partial(type(self), self.kind, self.detail, **self.extensions), ()

    def __str__(self) -> str:
        return f"{self.kind.title}: {self.detail}"


def invalid(field: str, value: object, limit: str) -> Problem:
    """Return the problem of a value that cannot be used."""
    return Problem(
        INVALID_REQUEST, f"{field} must be {limit}.", field=field, value=value, limit=limit
    )
