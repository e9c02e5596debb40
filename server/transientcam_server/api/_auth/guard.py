"""Authentication: the token of a request or a stream, and whether one is required."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from transientcam_server.api._auth.tokens import Role, TokenFile, utc_now
from transientcam_server.api._problems import problem_response
from transientcam_server.errors import Problem, TokenFileError, kinds
from transientcam_server.settings import Settings

_log = logging.getLogger("transientcam_server.api.auth.guard")
_GUARDED: Final = ("/api/v1/", "/metrics")
_FORWARDED: Final = ("forwarded", "x-forwarded-for")


@dataclass(frozen=True, slots=True)
class Principal:
    """An authenticated client; ``token_id`` is None where no token was required."""

    name: str
    role: Role
    may_light: bool
    token_id: str | None = None


UNAUTHENTICATED: Final = Principal("anybody", Role.ADMIN, may_light=True)
"""Every client of a service that requires no token."""


class Guard:
    """Decides which clients are admitted.

    No token is needed where only this machine reaches the service, unless a proxy has forwarded
    the request, and none where ``insecure`` says so.
    """

    def __init__(self, settings: Settings, *, now: Callable[[], datetime] = utc_now) -> None:
        self.tokens = TokenFile(settings.tokens_file)
        self._insecure = settings.insecure
        self._required = settings.needs_token
        self._now = now

    def identify(self, headers: Headers, *, first_message: str | None = None) -> Principal:
        """Return who sends a request with these headers, or a stream with this first message.

        Raises Problem ``token-required`` without a token where one is needed, ``token-refused``.
        """
        token = first_message if first_message is not None else _shown(headers)
        if token is not None:
            return self._check(token)
        forwarded = any(name in headers for name in _FORWARDED)
        if self._required or (forwarded and not self._insecure):
            raise Problem(kinds.TOKEN_REQUIRED, "This service requires a token.")
        return UNAUTHENTICATED

    def still_valid(self, principal: Principal) -> bool:
        """Return whether a client that was admitted still is."""
        if principal.token_id is None:
            return True
        try:
            return self.tokens.has(principal.token_id, now=self._now())
        except TokenFileError:
            return False

    def _check(self, text: str) -> Principal:
        try:
            token = self.tokens.find(text, now=self._now())
        except TokenFileError as error:
            _log.error("no token is valid: %s", error)
            token = None
        if token is None:
            raise Problem(kinds.TOKEN_REFUSED, "This token is unknown, revoked or expired.")
        return Principal(token.name, token.rank, token.lights, token.id)


class Authentication:
    """Refuses requests without a valid token; streams authenticate by themselves."""

    def __init__(self, app: ASGIApp, *, guard: Guard) -> None:
        self._app = app
        self._guard = guard

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on with `Principal` in the request's state."""
        if scope["type"] != "http" or not scope["path"].startswith(_GUARDED):
            await self._app(scope, receive, send)
            return
        try:
            principal = self._guard.identify(Headers(scope=scope))
        except Problem as problem:
            log_refusal(scope, problem)
            response = problem_response(problem, instance=scope["path"])
            response.headers["WWW-Authenticate"] = "Bearer"
            await response(scope, receive, send)
            return
        scope.setdefault("state", {})["principal"] = principal
        await self._app(scope, receive, send)


def log_refusal(scope: Scope, problem: Problem) -> None:
    """Log that a client was refused; never its token."""
    client = scope.get("client")
    who = client[0] if client else "a client"
    _log.warning("%s was not let in to %s: %s", who, scope["path"][:200], problem.kind.slug)


def _shown(headers: Headers) -> str | None:
    scheme, _, credentials = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return credentials.strip()
    return headers.get("x-api-key")
