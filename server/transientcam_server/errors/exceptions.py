"""Everything this package raises; over HTTP and the stream each is an RFC 9457 problem.

::

    ServerError
    ├── SettingsError        a setting cannot be used; says where it was given
    ├── AddressUnavailable   the address cannot be listened on
    ├── MissingExtra         something optional is asked for that is not installed
    ├── InputError           a file given to `transientcam reconstruct` cannot be used
    ├── RecordingError       something about a recording
    │   ├── NotARecording    a file cannot be read as one
    │   ├── DamagedFrame     a frame's bytes are not the ones that were written
    │   └── NotConvertible   the format asked for is none that recordings are converted to
    ├── TokenFileError       the file of tokens cannot be read or written
    ├── UnknownToken         no token has this id
    ├── JobCancelled         a client cancelled a job
    ├── SequenceConflict     the running sequence is not the one that a change was made for
    └── Problem              a request cannot be answered; see `transientcam_server.api.problems`

Errors of the driver and of the arithmetic become problems in one place,
`transientcam_server.api.problems.problem_of`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from transientcam_driver import AppliedSequence
from transientcam_server.errors.kinds import ProblemKind


class ServerError(Exception):
    """Root of all errors of this package."""


@dataclass(frozen=True, slots=True)
class SettingsMistake:
    """One setting that cannot be used: where it was given, and what it should be."""

    place: str
    value: object
    reason: str

    def __str__(self) -> str:
        return f"{self.place}: {self.reason} (given: {self.value!r})"


class SettingsError(ServerError):
    """Settings cannot be used; ``mistakes`` lists every one of them with its place."""

    def __init__(self, mistakes: Sequence[SettingsMistake]) -> None:
        super().__init__(*mistakes)
        self.mistakes = tuple(mistakes)

    def __str__(self) -> str:
        return "\n".join(str(mistake) for mistake in self.mistakes)


class AddressUnavailable(ServerError):  # noqa: N818 - says what is wrong
    """The address cannot be listened on."""

    def __init__(self, host: str, port: int, reason: str) -> None:
        super().__init__(host, port, reason)
        self.host = host
        self.port = port
        self.reason = reason

    def __str__(self) -> str:
        return f"cannot listen on {self.host}, port {self.port}: {self.reason}"


class MissingExtra(ServerError):  # noqa: N818 - says what is wrong
    """Something optional was asked for whose packages are not installed."""

    def __init__(self, what: str, module: str, extra: str) -> None:
        super().__init__(what, module, extra)
        self.what = what
        self.module = module
        self.extra = extra

    def __str__(self) -> str:
        return f"{self.what} needs {self.module}: pip install 'transientcam[{self.extra}]'"


class InputError(ServerError):
    """A measurement cannot be reconstructed: ``key`` of ``file`` is ``found``, not ``expected``."""

    def __init__(self, file: str, key: str, found: str, expected: str) -> None:
        super().__init__(file, key, found, expected)
        self.file = file
        self.key = key
        self.found = found
        self.expected = expected

    def __str__(self) -> str:
        return f"{self.file}: {self.key} is {self.found}, but must be {self.expected}"


class RecordingError(ServerError):
    """Something about a recording."""


class NotARecording(RecordingError):  # noqa: N818 - says what is wrong
    """A file cannot be read as a recording."""

    def __init__(self, file: str, reason: str) -> None:
        super().__init__(file, reason)
        self.file = file
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.file} is no recording that can be read: {self.reason}"


class DamagedFrame(RecordingError):  # noqa: N818 - says what is wrong
    """The bytes of a frame (counted from 0) are not the ones that were written."""

    def __init__(self, file: str, frame: int, reason: str) -> None:
        super().__init__(file, frame, reason)
        self.file = file
        self.frame = frame
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.file}: frame {self.frame} is damaged: {self.reason}"


class NotConvertible(RecordingError):  # noqa: N818 - says what is wrong
    """A file's suffix names no format that recordings are converted to."""

    def __init__(self, file: str, known: Sequence[str]) -> None:
        super().__init__(file, tuple(known))
        self.file = file
        self.known = tuple(known)

    def __str__(self) -> str:
        return f"{self.file}: recordings are converted to {', '.join(self.known)}"


class TokenFileError(ServerError):
    """The file of tokens cannot be read or written."""

    def __init__(self, file: str, reason: str) -> None:
        super().__init__(file, reason)
        self.file = file
        self.reason = reason

    def __str__(self) -> str:
        return f"the tokens in {self.file} cannot be used: {self.reason}"


class UnknownToken(ServerError):  # noqa: N818 - says what is wrong
    """No token has this id."""

    def __init__(self, token_id: str, file: str) -> None:
        super().__init__(token_id, file)
        self.token_id = token_id
        self.file = file

    def __str__(self) -> str:
        return f"{self.file} has no token {self.token_id}"


class JobCancelled(ServerError):  # noqa: N818 - says what is wrong
    """Somebody wants a job to end."""

    def __init__(self, job_id: str) -> None:
        super().__init__(job_id)
        self.job_id = job_id

    def __str__(self) -> str:
        return f"the job {self.job_id} was cancelled"


class SequenceConflict(ServerError):  # noqa: N818 - says what is wrong
    """The sequence was changed since; ``running`` is the one that runs now."""

    def __init__(self, running: AppliedSequence) -> None:
        super().__init__(running)
        self.running = running

    def __str__(self) -> str:
        return f"the running sequence has epoch {self.running.epoch}"


class Problem(ServerError):  # noqa: N818 - RFC 9457 calls it so
    """A request that cannot be answered.

    Attributes
    ----------
    kind
        What sort of problem, with its HTTP status and its page.
    detail
        One sentence about this occurrence.
    extensions
        What a program may want to read: mostly ``field``, ``value`` and ``limit``.
    """

    def __init__(self, kind: ProblemKind, detail: str, **extensions: object) -> None:
        super().__init__(kind.slug, detail)
        self.kind = kind
        self.detail = detail
        self.extensions = extensions

    def __str__(self) -> str:
        return f"{self.kind.title}: {self.detail}"
