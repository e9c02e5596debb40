"""The one place where errors of the other packages become problems."""

import math
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from transientcam.errors import ProtocolError
from transientcam_driver import (
    CalibrationMismatch,
    CameraError,
    CameraLost,
    CameraNotFound,
    DriverError,
    EffectError,
    SceneError,
    SequenceError,
)
from transientcam_moments import ParameterError
from transientcam_server.errors import _kinds as kinds
from transientcam_server.errors._exceptions import OriginRefused, Problem
from transientcam_server.errors._kinds import ProblemKind

_SHOWN_CHARACTERS = 200
_SHOWN_LEVELS = 8
_SHOWN_BITS = 128
_FieldError = SequenceError | EffectError | ParameterError | ProtocolError
_OF_ANY_PROBLEM = frozenset(("type", "title", "status", "detail", "instance", "request_id"))


class ProblemDocument(BaseModel):
    """A problem as RFC 9457 describes it."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="identifies the kind of problem; a page of this service")
    title: str = Field(description="the kind of problem in one sentence")
    status: int = Field(description="the HTTP status")
    detail: str = Field(description="this occurrence in one sentence")
    instance: str | None = Field(default=None, description="the path that was requested")
    request_id: str | None = Field(
        default=None, description="names the request in the service's log; also in X-Request-ID"
    )
    field: str | None = Field(default=None, description="the part of the request that was refused")
    value: Any = Field(default=None, description="what it was")
    limit: Any = Field(default=None, description="what it may be")


def problem_document(problem: Problem, *, instance: str | None = None) -> dict[str, Any]:
    """Return a problem as the map that travels as JSON and inside stream messages."""
    document: dict[str, Any] = {
        "type": problem.kind.type,
        "title": problem.kind.title,
        "status": problem.kind.status,
        "detail": _encodable(problem.detail),  # it may name a field in the client's words
    }
    if instance is not None:
        document["instance"] = instance
    return document | {key: plain(value) for key, value in problem.extensions.items()}


def problem_of(error: Exception) -> Problem:
    """Return the problem that stands for any error of this project.

    An error that belongs to none of its packages becomes ``internal-error``, without its text:
    that goes to the log alone.
    """
    match error:
        case Problem():
            return error
        case OriginRefused():
            return _of_origin(error)
        case SequenceError():
            return _of_field(kinds.INVALID_SEQUENCE, error)
        case CalibrationMismatch():
            return Problem(
                kinds.CALIBRATION_MISFIT,
                f"{str(error)[0].upper()}{str(error)[1:]}.",
                field=error.field,
                value=error.value,
                limit=error.needed,
            )
        case CameraLost() | CameraNotFound():
            return Problem(kinds.CAMERA_LOST, str(error))
        case ParameterError() | EffectError():
            return _of_field(kinds.INVALID_REQUEST, error)
        case SceneError():
            return Problem(
                kinds.INVALID_REQUEST,
                # its value may be as long as the file
                f"{error.file}: {error.key} = {shortened(repr(plain(error.value)))}: "
                f"must be {error.allowed}",
                field=error.key,
                value=error.value,
                limit=error.allowed,
            )
        case CameraError() | DriverError():
            return Problem(kinds.CAMERA_FAILED, str(error))
        case ProtocolError():
            return _of_field(kinds.BAD_MESSAGE, error)
        case _:
            return Problem(kinds.INTERNAL_ERROR, "The service failed; its log has the details.")


def _of_field(kind: ProblemKind, error: _FieldError) -> Problem:
    return Problem(kind, str(error), field=error.field, value=error.value, limit=error.limit)


def _of_origin(error: OriginRefused) -> Problem:
    """Return the origin's problem as one of this service, where it has the same kind."""
    slug = str(error.problem.get("type", "")).removeprefix("/problems/")
    extensions = {key: each for key, each in error.problem.items() if key not in _OF_ANY_PROBLEM}
    return Problem(kinds.KINDS.get(slug, kinds.CAMERA_FAILED), str(error), **extensions)


def plain(value: object, *, levels: int = _SHOWN_LEVELS) -> object:
    """Return a value as JSON can carry it: no NaN, nothing long or deep, no foreign type."""
    match value:
        case None | bool():
            return value
        case int():
            bits = value.bit_length()  # of very many no text is made
            return value if bits <= _SHOWN_BITS else f"an integer of {bits} bits"
        case float():
            return value if math.isfinite(value) else str(value)
        case str():
            return shortened(value)
        case dict() | list() | tuple() if levels == 0:
            return "…"
        case dict():
            shown = list(value.items())[:64]
            return {shortened(str(key)): plain(each, levels=levels - 1) for key, each in shown}
        case list() | tuple():
            return [plain(each, levels=levels - 1) for each in value[:64]]
        case _:
            return shortened(str(value))


def shortened(text: str) -> str:
    """Return a text of at most 200 characters that can be encoded."""
    text = _encodable(text)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


def _encodable(text: str) -> str:
    """Return a text without halves of characters (surrogates), which JSON can escape."""
    return text.encode("utf-8", "replace").decode()
