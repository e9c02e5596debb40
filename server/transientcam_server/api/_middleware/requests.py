"""The log of requests: ids, outcomes counted and logged, and an answer to every failure."""

import logging
import re
import secrets
import time
from typing import Final

from fastapi.exceptions import ValidationException
from pydantic import ValidationError
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from transientcam_server.api._metrics import Metrics
from transientcam_server.api._problems import problem_response
from transientcam_server.errors import problem_of
from transientcam_server.logs import request_id

_log = logging.getLogger("transientcam_server.api.middleware.requests")
REQUEST_ID_HEADER: Final = "X-Request-ID"
_ACCEPTED: Final = re.compile(r"[A-Za-z0-9._:+/=-]{1,128}")
_HEAD: Final = "transientcam.head"
_READS: Final = frozenset(("GET", "HEAD", "OPTIONS"))


def asks_for_head(scope: Scope) -> bool:
    """Whether a request that is answered as GET is HEAD; an endless answer must not start then."""
    return bool(scope.get(_HEAD))


def without_bodies(error: Exception) -> Exception:
    """Return an error without those before it that quote the body of a request."""
    each: BaseException = error
    while (before := each.__cause__ or each.__context__) is not None:
        if isinstance(before, ValidationException | ValidationError):
            each.__cause__ = each.__context__ = None
            break
        each = before
    return error


class RequestLog:
    """Gives every request an id, and every failure an answer.

    An id that the client sends in ``X-Request-ID`` is kept if it may stand in a log. HEAD is
    answered as GET without its body.
    """

    def __init__(self, app: ASGIApp, *, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, then count and log it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        # the server runs each request in a context of its own, so nothing is to be undone
        sent = Headers(scope=scope).get(REQUEST_ID_HEADER, "")
        identifier = sent if _ACCEPTED.fullmatch(sent) else secrets.token_hex(8)
        request_id.set(identifier)
        if scope["type"] == "websocket":
            await self._app(scope, receive, send)
        else:
            await self._answer(scope, receive, send, identifier)

    async def _answer(self, scope: Scope, receive: Receive, send: Send, identifier: str) -> None:
        status = 0
        begin_s = time.perf_counter()
        head = scope["method"] == "HEAD"

        async def observed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[REQUEST_ID_HEADER] = identifier
            elif head:
                message = {**message, "body": b""}
            await send(message)

        inner = {**scope, "method": "GET", _HEAD: True} if head else scope
        try:
            await self._app(inner, receive, observed)
        except Exception as error:
            place = scope["method"], scope["path"][:200]
            _log.error("%s %s failed", *place, exc_info=without_bodies(error))
            if status:  # it has begun: only an abort shows the client that it failed
                raise
            response = problem_response(problem_of(error), instance=scope["path"])
            await response(inner, receive, observed)
        self._metrics.answered(status or 499)  # the client was gone
        self._note(inner, scope["method"], status, time.perf_counter() - begin_s)

    def _note(self, scope: Scope, method: str, status: int, duration_s: float) -> None:
        """Log a request: a change at the level info, a read at debug."""
        principal = scope.get("state", {}).get("principal")
        level = logging.DEBUG if method in _READS else logging.INFO
        details = {
            "method": method,
            "path": scope["path"][:200],
            "status": status,
            "duration_s": round(duration_s, 6),
            "principal": None if principal is None else principal.name,
        }
        _log.log(
            level,
            "%s %s: %d, for %s",
            method,
            details["path"],
            status,
            details["principal"],
            extra=details,
        )
