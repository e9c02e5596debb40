"""Everything this package raises.

::

    TransientcamError
    ├── ServerUnreachable     nobody answers at the address, or not in time
    ├── ProblemError          the server answered with a problem (RFC 9457)
    ├── ProtocolError         bytes that are not the protocol of docs/stream.md
    ├── StreamClosed          the stream ended, by the server or by the network
    ├── FrameTimeout          the stream stands, but no frame came in the time allowed
    ├── ParameterError        an argument given here that cannot be used
    ├── CommandUnavailable    a verb of the command line whose packages are not installed
    ├── PromiseBroken         a camera does not do what is documented (transientcam conformance)
    └── CheckSkipped          a promise that cannot be tried on this camera (the same)

Each carries its data in fields and builds its own sentence from them.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

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


class ServerUnreachable(TransientcamError):  # noqa: N818 - a state has no "Error" in its name
    """Nobody answers at ``url``, or the connection broke before the answer was complete."""

    def __init__(self, url: str, reason: str) -> None:
        super().__init__(url, reason)
        self.url = url
        self.reason = reason

    def __str__(self) -> str:
        return f"No camera answers at {self.url}: {self.reason}"


class ProblemError(TransientcamError):
    """The server refused a request and said why.

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
        server does not say.
    document
        The whole problem as the server sent it.
    """

    def __init__(
        self,
        *,
        status: int,
        type: str = "about:blank",  # noqa: A002 - RFC 9457 calls it so
        title: str = "",
        detail: str = "",
        field: str | None = None,
        value: object = None,
        limit: object = None,
        document: Mapping[str, object] | None = None,
    ) -> None:
        super().__init__(status, type, title, detail)
        self.status = status
        self.type = type
        self.title = title
        self.detail = detail
        self.field = field
        self.value = value
        self.limit = limit
        self.document = dict(document or {})

    def __str__(self) -> str:
        what = self.detail or self.title or self.type
        return f"{what} ({self.status})" if self.status else what

    def __reduce__(self) -> tuple[Any, ...]:
        # exceptions are rebuilt from positional arguments, which this one does not take
        return partial(type(self), status=self.status), (), vars(self)


class ProtocolError(TransientcamError):
    """A message is not what docs/stream.md allows.

    ``field`` is the path of the offending part (``subscriptions[0].product``; ``message`` where
    it is the whole), ``value`` what stands there, ``limit`` what may.
    """

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(field, value, limit)
        self.field = field
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        return f"{self.field} is {shown(self.value)}, but must be {self.limit}"


class StreamClosed(TransientcamError):  # noqa: N818 - the same
    """The stream ended: ``code`` as in docs/stream.md (1006 where the connection just broke)."""

    def __init__(self, code: int, reason: str = "") -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason

    def __str__(self) -> str:
        return f"The stream closed ({self.code}): {self.reason or 'no reason was given'}"


class FrameTimeout(TransientcamError):  # noqa: N818 - the same
    """No frame came within ``timeout_s``; the stream stays open."""

    def __init__(self, timeout_s: float) -> None:
        super().__init__(timeout_s)
        self.timeout_s = timeout_s

    def __str__(self) -> str:
        return f"No frame came within {self.timeout_s:g} s"


class ParameterError(TransientcamError, ValueError):
    """An argument cannot be used: ``field`` names it, ``limit`` says what would do."""

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(field, value, limit)
        self.field = field
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        return f"{self.field} is {shown(self.value)}, but must be {self.limit}"


class CommandUnavailable(TransientcamError):  # noqa: N818 - the same
    """The command line's ``verb`` needs ``module``, which comes with ``extra`` (None: unknown)."""

    def __init__(self, verb: str, module: str, extra: str | None) -> None:
        super().__init__(verb, module, extra)
        self.verb = verb
        self.module = module
        self.extra = extra

    def __str__(self) -> str:
        remedy = f": pip install 'transientcam[{self.extra}]'" if self.extra else ""
        return f"'transientcam {self.verb}' needs {self.module}, which is not installed{remedy}"


class PromiseBroken(TransientcamError):  # noqa: N818 - the same
    """A camera does not do what is documented; ``what`` says what it does instead."""

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what

    def __str__(self) -> str:
        return self.what


class CheckSkipped(TransientcamError):  # noqa: N818 - the same
    """A promise cannot be tried on this camera; ``why`` says why not."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return self.why
