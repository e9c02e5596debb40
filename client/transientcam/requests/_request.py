"""One request and the reading of its answer, as values."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

import numpy as np

from transientcam.errors import ParameterError, ProblemError, ProtocolError
from transientcam.wire import MAX_SERVER_MESSAGE_BYTES, PROBLEM_MEDIA_TYPE

_T = TypeVar("_T")
_JSON: Final = "application/json"
MOST_DOCUMENT_BYTES: Final = 16 * 1024 * 1024
"""The client reads no document longer than this."""


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer read to its end: status, media type (without parameters) and body."""

    status: int
    media_type: str
    body: bytes
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Request(Generic[_T]):
    """What to send, and how to read the answer."""

    method: str
    path: str
    read: Callable[[Answer], _T]
    params: tuple[tuple[str, str], ...] = ()
    body: bytes | None = None
    accept: str = _JSON
    extra_timeout_s: float = 0.0
    """How much longer than usual the server may take, because the request lets it wait."""
    content_type: str = _JSON
    """Of the body, where there is one."""
    most_bytes: int = MOST_DOCUMENT_BYTES
    """The longest answer that is read."""

    @property
    def headers(self) -> dict[str, str]:
        """Headers that belong to this request."""
        accept = {"accept": f"{self.accept}, {PROBLEM_MEDIA_TYPE}"}
        return accept if self.body is None else accept | {"content-type": self.content_type}

    def result(self, answer: Answer) -> _T:
        """Return the value that the answer holds.

        Raises
        ------
        ProblemError
            If the server refused the request.
        ProtocolError
            If the answer is not what this request is answered with.
        """
        if not 200 <= answer.status < 300:
            raise problem(answer)
        return self.read(answer)


def document(
    path: str,
    *,
    method: str = "GET",
    body: Mapping[str, Any] | None = None,
    params: Iterable[tuple[str, object]] = (),
    extra_timeout_s: float = 0.0,
) -> Request[dict[str, Any]]:
    """Build a request that is answered with a JSON object."""
    return Request(
        method,
        path,
        _read_document,
        query(params),
        None if body is None else _json_bytes(body),
        extra_timeout_s=extra_timeout_s,
    )


def file(path: str, media_type: str) -> Request[bytes]:
    """Build a request that is answered with a file."""
    return Request(
        "GET",
        path,
        lambda answer: body_of(answer, media_type),
        accept=media_type,
        most_bytes=MAX_SERVER_MESSAGE_BYTES,
    )


def upload(
    path: str, content: bytes, *, media_type: str, extra_timeout_s: float
) -> Request[dict[str, Any]]:
    """Build a request that sends a file and is answered with a JSON object."""
    return Request(
        "POST",
        path,
        _read_document,
        body=content,
        extra_timeout_s=extra_timeout_s,
        content_type=media_type,
    )


def problem(answer: Answer) -> ProblemError:
    """Return the error that a refusal stands for, whether it is a problem document or not."""
    if answer.media_type == PROBLEM_MEDIA_TYPE:
        try:
            return problem_error(_object(answer.body), status=answer.status)
        except ProtocolError:
            pass  # a malformed problem is still a refusal
    # the page of a proxy: its reason phrase is enough, unless it is plain text
    plain = answer.body[:200] if answer.media_type == "text/plain" else b""
    text = plain.decode("utf-8", "replace").strip()
    return ProblemError(status=answer.status, title=answer.reason, detail=text)


def problem_error(fields: Mapping[str, Any], *, status: int = 0) -> ProblemError:
    """Return the error that a problem document (RFC 9457) stands for."""

    def text(key: str, default: str) -> str:
        value = fields.get(key)
        return value if isinstance(value, str) else default

    stated = fields.get("status")
    return ProblemError(
        status=status or (stated if isinstance(stated, int) else 0),
        type=text("type", "about:blank"),
        title=text("title", ""),
        detail=text("detail", ""),
        field=text("field", "") or None,
        value=fields.get("value"),
        limit=fields.get("limit"),
        document=dict(fields),
    )


def _read_document(answer: Answer) -> dict[str, Any]:
    return _object(body_of(answer, _JSON))


def body_of(answer: Answer, media_type: str) -> bytes:
    """Return the body of an answer of a media type.

    Raises ProtocolError if its media type is another.
    """
    if answer.media_type != media_type:
        raise ProtocolError("content-type", answer.media_type, media_type)
    return answer.body


def _object(body: bytes) -> dict[str, Any]:
    try:
        value = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise ProtocolError("body", body[:80], "JSON") from error
    if not isinstance(value, dict):
        raise ProtocolError("body", value, "a JSON object")
    return value


def _json_bytes(value: Mapping[str, Any]) -> bytes:
    try:
        return json.dumps(value, default=_plain, allow_nan=False).encode()
    except (ValueError, TypeError) as error:
        raise ParameterError("document", value, "numbers, strings, lists and maps") from error


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no JSON")


def query(params: Iterable[tuple[str, object]]) -> tuple[tuple[str, str], ...]:
    """Return parameters as strings, without those that are None."""
    return tuple((key, str(value)) for key, value in params if value is not None)


def given(**parts: object) -> dict[str, Any]:
    """Return the parts of a document that are not None: the others are left to the server."""
    return {name: part for name, part in parts.items() if part is not None}


def recording_path(recording_id: str) -> str:
    """Return the path of a recording.

    Raises ParameterError if ``recording_id`` is no id.
    """
    return f"recordings/{segment(recording_id)}"


def segment(name: str) -> str:
    """Return a name that may be a part of a path.

    Raises ParameterError if it would be more than that.
    """
    if not name or not name.replace("-", "").replace("_", "").isalnum():
        raise ParameterError("product", name, "a product's name, such as range")
    return name
