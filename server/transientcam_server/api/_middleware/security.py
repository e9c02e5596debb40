"""What a browser and its pages may do here: Host and Origin checks, headers, size of bodies.

All three are plain ASGI, so the stream passes through them like any request.
"""

import socket
from ipaddress import ip_address
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from transientcam_server.api._problems import problem_response
from transientcam_server.errors import Problem, kinds
from transientcam_server.settings import Settings

MAX_BODY_BYTES: Final = 1024 * 1024
_SAFE_METHODS = frozenset(("GET", "HEAD", "OPTIONS"))
_LOOPBACK_NAMES = frozenset(("localhost", "127.0.0.1", "[::1]"))
_DEFAULT_PORTS = {"http": 80, "https": 443}
_WITH_FRAMES: Final = "/cameras"
"""The page that shows the pages of other cameras."""

SECURITY_HEADERS: Final = {
    # the page's own files and nothing else; blob: for the workers and pictures it makes itself
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        "font-src 'self'; connect-src 'self'; worker-src 'self' blob:; manifest-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class SecurityHeaders:
    """Adds `SECURITY_HEADERS` to every answer; pages of ``framed_by`` may hold them in frames."""

    def __init__(self, app: ASGIApp, *, framed_by: tuple[str, ...] = ()) -> None:
        self._app = app
        origins = (each.rstrip("/") for each in framed_by)
        policy = " ".join((SECURITY_HEADERS["Content-Security-Policy"], *origins))
        self._headers = SECURITY_HEADERS | {"Content-Security-Policy": policy}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with the headers added."""

        async def with_headers(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
                if scope["path"] == _WITH_FRAMES:
                    headers["Content-Security-Policy"] += "; frame-src http: https:"
            await send(message)

        await self._app(scope, receive, with_headers)


class RootPath:
    """Takes off the path below which a proxy serves this; no ``Location`` begins at the root."""

    def __init__(self, app: ASGIApp, *, root_path: str) -> None:
        self._app = app
        self._root = root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer as without it; the path itself leads to the page below it."""
        path, raw = str(scope.get("path", "")), bytes(scope.get("raw_path") or b"")
        root = self._root.encode()
        if root and path == self._root and scope["type"] == "http":
            # what the page names is relative to it
            await RedirectResponse(_relative(f"{path}/", path), 308)(scope, receive, send)
            return
        if path.startswith(f"{self._root}/") and raw.startswith(root):
            scope = {**scope, "path": path[len(root) :], "raw_path": raw[len(root) :]}

        async def below(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                location = headers.get("location", "")
                here = f"{scope['scheme']}://{Headers(scope=scope).get('host', '')}/"
                if location.startswith(("/", here)):
                    target = "/" + location.removeprefix(here).removeprefix("/")
                    headers["location"] = _relative(target, scope["path"])
            await send(message)

        await self._app(scope, receive, below)


def _relative(target: str, path: str) -> str:
    """Return the address of ``target`` from ``path``, both below the same root."""
    there, here = target.split("/")[1:], path.split("/")[1:-1]
    while here and len(there) > 1 and here[0] == there[0]:
        del here[0], there[0]
    return "../" * len(here) + "/".join(there) or "./"


def own_names() -> tuple[str, ...]:
    """Return the names of this machine: fully qualified, short, and on the local link."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return name, short, f"{short}.local"


class OriginCheck:
    """Refuses requests for other hosts, and changes by pages of other origins.

    The first keeps a foreign page from rebinding its name to this address; the second covers
    WebSockets, which the browser's same-origin policy leaves to the server. Pages of other sites
    load nothing from here either: as a picture, say, what costs much to compute. Browsers say so in
    Fetch Metadata (https://www.w3.org/TR/fetch-metadata/).
    """

    def __init__(self, app: ASGIApp, *, settings: Settings) -> None:
        self._app = app
        self._names = {name.lower() for name in settings.allowed_hosts}
        self._names |= _LOOPBACK_NAMES | {settings.host.lower(), f"[{settings.host.lower()}]"}
        self._origins = {origin.lower().rstrip("/") for origin in settings.allowed_origins}
        # a service that other machines can reach is called by its addresses and its names
        self._any_address = not settings.on_loopback
        if self._any_address:
            self._names |= set(own_names())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        problem = self._problem(scope, Headers(scope=scope))
        if problem is None:
            await self._app(scope, receive, send)
        else:
            response = problem_response(problem, instance=scope["path"])
            await _answer(response, scope, receive, send)

    def _problem(self, scope: Scope, headers: Headers) -> Problem | None:
        if len(headers.getlist("host")) > 1:  # RFC 9112, 3.2: which of them is meant?
            return Problem(kinds.BAD_REQUEST, "There are several Host headers.", field="Host")
        host = headers.get("host", "").lower()
        if not self._is_ours(_name(host)):
            detail = "The Host header names no host that is served here."
            return Problem(
                kinds.HOST_NOT_ALLOWED, detail, field="Host", value=host, limit=sorted(self._names)
            )
        origin = headers.get("origin", "").lower().rstrip("/")
        if _is_embedded(headers, framed=bool(self._origins)) and origin not in self._origins:
            detail = "A page of another site may link to this, but not load it."
            site = headers["sec-fetch-site"]
            return Problem(kinds.ORIGIN_NOT_ALLOWED, detail, field="Sec-Fetch-Site", value=site)
        if not origin or (scope["type"] == "http" and scope["method"] in _SAFE_METHODS):
            return None
        if origin in self._origins or self._is_same(origin, host):
            return None
        detail = "A page of another origin may not do this."
        return Problem(kinds.ORIGIN_NOT_ALLOWED, detail, field="Origin", value=origin)

    def _is_same(self, origin: str, host: str) -> bool:
        try:
            theirs = urlsplit(origin)
            ours = urlsplit(f"{theirs.scheme}://{host}")
            default = _DEFAULT_PORTS.get(theirs.scheme)
            ports = theirs.port or default, ours.port or default
        except ValueError:  # no URL
            return False
        return bool(theirs.hostname) and theirs.hostname == ours.hostname and ports[0] == ports[1]

    def _is_ours(self, name: str) -> bool:
        if name in self._names:
            return True
        if not self._any_address:
            return False
        try:
            ip_address(name.strip("[]"))
        except ValueError:
            return False
        return True


class BodyLimit:
    """Refuses bodies longer than ``limit`` bytes, announced or not.

    The routes at ``counted_elsewhere`` take files, and hold them to limits of their own.
    """

    def __init__(
        self,
        app: ASGIApp,
        *,
        limit: int = MAX_BODY_BYTES,
        counted_elsewhere: frozenset[str] = frozenset(),
    ) -> None:
        self._app = app
        self._limit = limit
        self._counted_elsewhere = counted_elsewhere

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on and count."""
        if scope["type"] != "http" or scope["path"] in self._counted_elsewhere:
            await self._app(scope, receive, send)
            return
        announced = Headers(scope=scope).get("content-length", "")
        if announced.isdecimal() and int(announced) > self._limit:
            await self._refuse(scope, receive, send)
            return
        if announced:
            await self._app(scope, receive, send)  # the server enforces the announced length
            return
        begin = [await receive()]
        received = len(begin[0].get("body", b""))
        while begin[-1].get("more_body", False):
            begin.append(await receive())
            received += len(begin[-1].get("body", b""))
            if received > self._limit:
                await self._refuse(scope, receive, send)
                return
        messages = iter(begin)

        async def replayed() -> Message:
            return next(messages, None) or await receive()

        await self._app(scope, replayed, send)

    async def _refuse(self, scope: Scope, receive: Receive, send: Send) -> None:
        response = problem_response(self._problem(), instance=scope["path"])
        await response(scope, receive, send)

    def _problem(self) -> Problem:
        detail = f"The body is longer than {self._limit} bytes."
        return Problem(kinds.TOO_LARGE, detail, field="body", limit=self._limit)


def _is_embedded(headers: Headers, *, framed: bool) -> bool:
    """Whether a page of another site loads this, and no user goes there.

    A frame does not say whose it is: the browser looks that up in the policy's `frame-ancestors`.
    """
    followed = headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")
    by_users = ("document", "iframe") if framed else ("document",)
    visited = followed[0] == "navigate" and followed[1] in by_users
    return headers.get("sec-fetch-site") == "cross-site" and not visited


async def _answer(response: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()  # websocket.connect, which the refusal answers
    await response(scope, receive, send)


def _name(host: str) -> str:
    """Return a Host header without its port; an IPv6 address keeps its brackets."""
    if host.startswith("["):
        return host.partition("]")[0] + "]"
    return host.partition(":")[0]
