"""Everything this package raises; over HTTP and the stream each is an RFC 9457 problem.

::

    ServerError
    ├── SettingsError        a setting cannot be used; says where it was given
    ├── AddressUnavailable   the address cannot be listened on
    ├── MissingExtra         something optional is asked for that is not installed
    ├── InputError           a file given to `transientcam reconstruct` cannot be used
    └── Problem              a request cannot be answered; see `transientcam_server.problems`

Errors of the driver and of the arithmetic become problems in one place,
`transientcam_server.problems.problem_of`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from transientcam_server.problem_kinds import ProblemKind


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
