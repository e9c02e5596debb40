"""A daemon that breaks one promise at a time: whatever passes it by can be corrupted."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from fastapi import FastAPI
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from transientcam import wire

Map = dict[str, Any]


@dataclass(frozen=True)
class Answer:
    """An answer over HTTP before it is sent."""

    method: str
    path: str
    query: str
    status: int
    headers: dict[str, str]
    body: bytes

    def with_json(self, **changes: Any) -> "Answer":
        """Return it with other values in its document; None takes a key away."""
        document = json.loads(self.body) | changes
        document = {key: value for key, value in document.items() if value is not None}
        return replace(self, body=json.dumps(document).encode())

    def without(self, header: str) -> "Answer":
        """Return it without a header."""
        return replace(self, headers={k: v for k, v in self.headers.items() if k != header})

    def plain(self, status: int) -> "Answer":
        """Return a plain text in its place."""
        headers = {**self.headers, "content-type": "text/plain"}
        return replace(self, status=status, headers=headers, body=b"something went wrong")


@dataclass(frozen=True)
class Breaking:
    """How a promise is broken; what is not named here stays as it is.

    Attributes
    ----------
    request
        Changes headers of a request, by lower-case name.
    answer
        Changes an answer.
    said
        Changes a message that a stream sends; None swallows it.
    heard
        The same for one that a stream receives.
    closed
        Changes a close code.
    """

    request: Callable[[dict[str, str]], dict[str, str]] = lambda headers: headers
    answer: Callable[[Answer], Answer] = lambda answer: answer
    said: Callable[[Map], Map | None] = lambda message: message
    heard: Callable[[Map], Map | None] = lambda message: message
    closed: Callable[[int], int] = lambda code: code


NOTHING = Breaking()


class Breaker:
    """Stands before an application and breaks what is ``current``."""

    def __init__(self) -> None:
        self.current = NOTHING
        self._app: ASGIApp | None = None

    def install(self, app: FastAPI) -> None:
        """Stand before ``app``."""
        breaker = self

        class _Middleware:
            def __init__(self, inner: ASGIApp) -> None:
                self._inner = inner

            async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
                breaking = breaker.current
                if breaking is NOTHING or scope["type"] not in ("http", "websocket"):
                    await self._inner(scope, receive, send)
                elif scope["type"] == "http":
                    await _http(breaking, self._inner, scope, receive, send)
                else:
                    await _websocket(breaking, self._inner, scope, receive, send)

        app.add_middleware(_Middleware)


async def _http(
    breaking: Breaking, app: ASGIApp, scope: Scope, receive: Receive, send: Send
) -> None:
    given = {name.decode(): value.decode("latin-1") for name, value in scope["headers"]}
    headers = breaking.request(given)
    scope = {**scope, "headers": [(k.encode(), v.encode("latin-1")) for k, v in headers.items()]}
    start: Message = {}
    body = b""

    async def collect(message: Message) -> None:
        nonlocal start, body
        if message["type"] == "http.response.start":
            start = message
        if (b"content-type", b"multipart") in [(k, v[:9]) for k, v in start["headers"]]:
            await send(message)  # it has no end
        elif message["type"] == "http.response.body":
            body += message.get("body", b"")
            if not message.get("more_body"):
                await _send_answer(breaking, scope, start, body, send)

    await app(scope, receive, collect)


async def _send_answer(
    breaking: Breaking, scope: Scope, start: Message, body: bytes, send: Send
) -> None:
    headers = {name.decode(): value.decode("latin-1") for name, value in start["headers"]}
    answer = breaking.answer(_answer(scope, start["status"], headers, body))
    fitting = {**answer.headers, "content-length": str(len(answer.body))}
    if scope["method"] == "HEAD":
        fitting["content-length"] = headers.get("content-length", "0")
    listed = [(name.encode(), value.encode("latin-1")) for name, value in fitting.items()]
    await send({"type": "http.response.start", "status": answer.status, "headers": listed})
    await send({"type": "http.response.body", "body": answer.body})


def _answer(scope: Scope, status: int, headers: dict[str, str], body: bytes) -> Answer:
    method, query = scope.get("method", "GET"), scope["query_string"].decode()
    return Answer(method, scope["path"], query, status, headers, body)


async def _websocket(
    breaking: Breaking, app: ASGIApp, scope: Scope, receive: Receive, send: Send
) -> None:
    async def say(message: Message) -> None:
        if message["type"] == "websocket.close":
            message = {**message, "code": breaking.closed(message.get("code", 1000))}
        elif message["type"] == "websocket.send" and message.get("bytes") is not None:
            said = breaking.said(wire.unpack(message["bytes"], max_bytes=2**30))
            if said is None:
                return
            message = {**message, "bytes": wire.pack(said)}
        elif message["type"] == "websocket.http.response.start":
            answer = breaking.answer(_answer(scope, message["status"], {}, b"{}"))
            message = {**message, "status": answer.status}
        await send(message)

    async def hear() -> Message:
        while True:
            message = await receive()
            if message["type"] != "websocket.receive" or message.get("bytes") is None:
                return message
            heard = breaking.heard(wire.unpack(message["bytes"], max_bytes=2**20))
            if heard is not None:
                return {**message, "bytes": wire.pack(heard)}

    await app(scope, hear, say)
