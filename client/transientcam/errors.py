"""Everything this package raises.

::

    TransientcamError
    ├── ServerUnreachable     no answer from the address, or none in time
    ├── ProblemError          the server answered with a problem (RFC 9457)
    ├── StreamClosed          the stream ended, by the server or by the network
    ├── FrameTimeout          the stream stands, but no frame came in the time allowed
    ├── (field, value, limit)
    │   ├── ProtocolError     bytes that are not the protocol of docs/stream.md
    │   └── ParameterError    an argument given here that cannot be used; a ValueError too
    ├── CommandUnavailable    a verb of the command line whose packages are not installed
    ├── MissingExtra          a function whose packages are not installed
    ├── PromiseBroken         a camera does not do what is documented (transientcam conformance)
    └── CheckSkipped          a promise that cannot be tried on this camera (the same)

Each is a dataclass: its fields are its data, and its sentence is built from them; in it stands no
sign of a server's that a terminal would obey.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from transientcam.text import plain

_SHOWN_CHARACTERS = 80


def shown(value: object) -> str:
    """Return a value as it may stand in a sentence: on one line, and not longer than a line."""
    text = repr(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


class TransientcamError(Exception):
    """Root of all errors of this package.

    ::

        try:
            frame = camera.frame("range")
        except transientcam.TransientcamError as error:
            print(error)
    """


@dataclass(eq=False, repr=False)
class _DataError(TransientcamError):
    """An error whose fields are its data; equal to nothing but itself, as exceptions are."""

    def __post_init__(self) -> None:
        # also where fields are given by name, which `Exception` itself does not keep
        named = dataclasses.fields(self)
        self.args = tuple(getattr(self, each.name) for each in named if each.repr)

    def __reduce__(self) -> tuple[Any, ...]:
        # exceptions are rebuilt from positional arguments, which not all of these take
        data = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        return partial(type(self), **data), (), vars(self)


@dataclass(eq=False, repr=False)
class ServerUnreachable(_DataError):  # noqa: N818 - a state has no "Error" in its name
    """No answer from ``url``, or the connection broke before the answer was complete."""

    url: str
    reason: str

    def __str__(self) -> str:
        return f"No camera answers at {plain(self.url)}: {plain(self.reason)}"


@dataclass(eq=False, repr=False, kw_only=True)
class ProblemError(_DataError):
    """The server refused a request, with a reason.

    Attributes
    ----------
    status
        The HTTP status; 0 where the problem came over the stream without one.
    type
        Identifies the kind of problem: ``/problems/<slug>``, or ``about:blank``.
    title, detail
        One sentence for the kind, one for this occurrence.
    field, value, limit
        Which part of the request was refused, what it was and what it may be; None where the
        server sends none.
    document
        The whole problem as the server sent it.
    """

    status: int
    type: str = "about:blank"
    title: str = ""
    detail: str = ""
    field: str | None = dataclasses.field(default=None, repr=False)
    value: object = dataclasses.field(default=None, repr=False)
    limit: object = dataclasses.field(default=None, repr=False)
    document: Mapping[str, object] = dataclasses.field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        what = plain(self.detail or self.title or self.type, lines=True)
        return f"{what} ({self.status})" if self.status else what


@dataclass(eq=False, repr=False)
class StreamClosed(_DataError):  # noqa: N818 - the same
    """The stream ended: ``code`` as in docs/stream.md (1006 where the connection just broke)."""

    code: int
    reason: str = ""

    def __str__(self) -> str:
        return f"The stream closed ({self.code}): {plain(self.reason) or 'no reason was given'}"


@dataclass(eq=False, repr=False)
class FrameTimeout(_DataError):  # noqa: N818 - the same
    """No frame came within ``timeout_s``; the stream stays open."""

    timeout_s: float

    def __str__(self) -> str:
        return f"No frame came within {self.timeout_s:g} s"


@dataclass(eq=False, repr=False)
class _WrongValueError(_DataError):
    """``field`` names what cannot be used, ``value`` is what it is, ``limit`` what it may be."""

    field: str
    value: object
    limit: str

    def __str__(self) -> str:
        return f"{self.field} is {shown(self.value)}, but must be {self.limit}"


class ProtocolError(_WrongValueError):
    """A message is not what docs/stream.md allows.

    ``field`` is the path of the offending part (``subscriptions[0].product``; ``message`` where
    it is the whole), ``value`` what stands there, ``limit`` what may.
    """


class ParameterError(_WrongValueError, ValueError):
    """An argument cannot be used: ``field`` names it, ``limit`` is what it may be."""


@dataclass(eq=False, repr=False)
class CommandUnavailable(_DataError):  # noqa: N818 - the same
    """The command line's ``verb`` needs ``module``, which comes with ``extra`` (None: unknown)."""

    verb: str
    module: str
    extra: str | None

    def __str__(self) -> str:
        remedy = f": pip install 'transientcam[{self.extra}]'" if self.extra else ""
        return f"'transientcam {self.verb}' needs {self.module}, which is not installed{remedy}"


@dataclass(eq=False, repr=False)
class MissingExtra(_DataError):  # noqa: N818 - the same
    """``what`` needs ``module``, which comes with ``extra``."""

    what: str
    module: str
    extra: str

    def __str__(self) -> str:
        return f"{self.what} needs {self.module}: pip install 'transientcam[{self.extra}]'"


@dataclass(eq=False, repr=False)
class PromiseBroken(_DataError):  # noqa: N818 - the same
    """A camera does not do what is documented; ``what`` is what it does instead."""

    what: str


@dataclass(eq=False, repr=False)
class CheckSkipped(_DataError):  # noqa: N818 - the same
    """A promise cannot be tried on this camera; ``why`` is the reason."""

    why: str
