"""Foreign errors, all of them."""

import inspect
import ssl
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import httpx
import pytest
import websockets.exceptions as ws
from websockets.datastructures import Headers
from websockets.frames import Close
from websockets.http11 import Response

from transientcam.errors import (
    ParameterError,
    ProblemError,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)
from transientcam.transport import translated
from transientcam.transport._errors import translate

_URL = "http://127.0.0.1:8000"


def _exceptions(module: ModuleType) -> Iterator[type[Exception]]:
    for name in module.__all__:
        each = getattr(module, name)
        if inspect.isclass(each) and issubclass(each, Exception):
            yield each


_ARGUMENTS: dict[str, Any] = {
    "rcvd": None,
    "sent": None,
    "response": Response(418, "I'm a teapot", Headers()),
    "status": 418,
    "headers": Headers(),
}


def _made(kind: type[Exception]) -> Exception:
    """Return an instance of any kind, each required argument filled in."""
    try:
        parameters = inspect.signature(kind).parameters
    except ValueError:  # one without a constructor of its own
        return kind("a reason")
    given, named = [], {}
    for name, parameter in parameters.items():
        value = _ARGUMENTS.get(name, "a reason")
        if parameter.default is parameter.empty and parameter.kind is parameter.KEYWORD_ONLY:
            named[name] = value
        elif parameter.default is parameter.empty and parameter.kind is not parameter.VAR_KEYWORD:
            given.append(value)
    return kind(*given, **named)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # the legacy ones still exist
@pytest.mark.parametrize(
    "kind", [*_exceptions(httpx), *_exceptions(ws)], ids=lambda kind: kind.__name__
)
def test_every_exception_of_the_libraries_becomes_one_of_ours(kind: type[Exception]) -> None:
    error = _made(kind)

    with pytest.raises(TransientcamError) as caught, translated(_URL):
        raise error

    assert caught.value.__cause__ is error
    assert str(caught.value)


def test_the_enumeration_above_is_not_empty() -> None:
    assert len([*_exceptions(httpx)]) > 20
    assert len([*_exceptions(ws)]) > 20


@pytest.mark.parametrize(
    ("error", "expected", "words"),
    [
        (httpx.ConnectError("[Errno 111] Connection refused"), ServerUnreachable, "refused"),
        (httpx.ConnectTimeout("timed out"), ServerUnreachable, "no answer in time"),
        (httpx.ReadTimeout(""), ServerUnreachable, "no answer in time"),
        (httpx.ReadError(""), ServerUnreachable, "ReadError"),
        (httpx.ProxyError("403"), ServerUnreachable, "403"),
        (httpx.RemoteProtocolError("?"), ServerUnreachable, "does not speak HTTP"),
        (httpx.UnsupportedProtocol("x"), ParameterError, "address"),
        (httpx.InvalidURL("x"), ParameterError, "address"),
        (httpx.DecodingError("x"), ProtocolError, "DecodingError"),
        (
            ConnectionRefusedError(111, "Connection refused"),
            ServerUnreachable,
            "Connection refused",
        ),
        (TimeoutError("timed out during opening handshake"), ServerUnreachable, "in time"),
        (ssl.SSLError(1, "certificate verify failed"), ServerUnreachable, "certificate"),
        (ws.InvalidURI("x", "bad"), ParameterError, "address"),
        (ws.InvalidMessage("x"), ServerUnreachable, "does not speak HTTP"),
        (ws.ProxyError("x"), ServerUnreachable, "proxy"),
        (ws.NegotiationError("no subprotocols supported"), ProtocolError, "subprotocols"),
        (ws.PayloadTooBig(2, 1), StreamClosed, "1009"),
        (ws.ConnectionClosedOK(Close(1000, ""), Close(1000, ""), True), StreamClosed, "1000"),
        (ws.ConnectionClosedError(Close(1001, "bye"), None, None), StreamClosed, "(1001): bye"),
        (ws.ConnectionClosedError(None, Close(1009, "big"), None), StreamClosed, "(1009): big"),
        (ws.ConnectionClosedError(None, None, None), StreamClosed, "(1006): the connection broke"),
    ],
)
def test_an_error_becomes_the_one_that_says_what_to_do(
    error: Exception, expected: type[Exception], words: str
) -> None:
    ours = translate(error, _URL)

    assert type(ours) is expected
    assert words in str(ours)


def test_what_the_operating_system_said_is_found_below_what_libraries_made_of_it() -> None:
    error = httpx.ConnectError("[Errno 113] No route to host")
    error.__cause__ = OSError("wrapped")
    error.__cause__.__context__ = OSError(113, "No route to host")

    assert str(translate(error, _URL)) == f"No camera answers at {_URL}: No route to host"


def test_a_refused_handshake_is_the_problem_in_its_body() -> None:
    body = b'{"type": "/problems/subprotocol-required", "detail": "Offer it.", "field": "f"}'
    headers = Headers({"content-type": "application/problem+json; charset=utf-8"})

    ours = translate(ws.InvalidStatus(Response(400, "Bad Request", headers, body)), _URL)

    assert isinstance(ours, ProblemError)
    assert (ours.status, ours.type, ours.field) == (400, "/problems/subprotocol-required", "f")
    assert str(ours) == "Offer it. (400)"


@pytest.mark.parametrize("error", [KeyError("x"), ValueError("x"), KeyboardInterrupt()])
def test_what_is_no_error_of_the_network_passes_through(error: Any) -> None:
    with pytest.raises(type(error)), translated(_URL):
        raise error


def test_our_own_errors_pass_through_untouched() -> None:
    error = ProtocolError("field", 1, "2")

    with pytest.raises(ProtocolError) as caught, translated(_URL):
        raise error

    assert caught.value is error
    assert caught.value.__cause__ is None
