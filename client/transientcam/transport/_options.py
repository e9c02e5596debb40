"""The options of httpx and websockets, for the synchronous and the asynchronous client."""

import logging
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, Final, TypeVar

import httpx
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from transientcam.errors import ParameterError, ProtocolError
from transientcam.requests import Request
from transientcam.transport._tls import shared_context
from transientcam.wire import LEASE_HEADER, MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL

USER_AGENT: Final = f"transientcam/{version('transientcam')}"
QUIET: Final = logging.getLogger("transientcam.websockets")
"""Of websockets, which would log every head and message: tokens and addresses with secrets."""
QUIET.setLevel(logging.CRITICAL)
_Client = TypeVar("_Client", httpx.Client, httpx.AsyncClient)
_CLOSE_WITHIN_S = 1.0
_LONGEST_S: Final = 366 * 86400.0
_QUEUED_MESSAGES = 256


def http_client(
    kind: type[_Client], *, token: str | None, timeout_s: float, **options: Any
) -> _Client:
    """Return a client of httpx.

    Raises ParameterError if the token is none, nothing can wait for so long, or the environment has
    proxies or authorities that cannot be used; no secret is shown.
    """
    # what is unpacked here has no bound: the bytes of an answer count as they travel
    headers = {"user-agent": USER_AGENT, "accept-encoding": "identity"}
    if token is not None:
        # what is no header is quoted in the error of the library
        if not token or not token.isascii() or not token.isprintable() or " " in token:
            raise ParameterError("token", "…", "printable ASCII without spaces")
        headers["authorization"] = f"Bearer {token}"
    try:
        return kind(headers=headers, timeout=_allowed_s(timeout_s), **options)
    except OSError as error:
        raise ParameterError("SSL_CERT_FILE or SSL_CERT_DIR", "…", f"read ({error})") from error
    except (ImportError, ValueError, httpx.InvalidURL) as error:
        limit = f"the address of an HTTP proxy ({error})"
        raise ParameterError("HTTP_PROXY, HTTPS_PROXY or ALL_PROXY", "…", limit) from error


def request_options(request: Request[Any], *, timeout_s: float) -> dict[str, Any]:
    """Return the options of one request, besides its method and address.

    Raises ParameterError if nothing can wait for so long.
    """
    return {
        "params": list(request.params),
        "content": request.body,
        "headers": request.headers,
        "timeout": _allowed_s(timeout_s + request.extra_timeout_s),
    }


def _allowed_s(timeout_s: float) -> float:
    if not 0.0 <= timeout_s <= _LONGEST_S:
        raise ParameterError("timeout", timeout_s, f"a time of at most {_LONGEST_S:.0f} s")
    return timeout_s


def set_lease(headers: httpx.Headers, lease_id: str | None) -> None:
    """Send this lease with every request from now on; None sends none."""
    if lease_id is None:
        headers.pop(LEASE_HEADER, None)
    else:
        headers[LEASE_HEADER] = lease_id


Progress = Callable[[int, int | None], object]
"""Takes the bytes received so far and their total; None where the total is unknown."""


class DownloadProgress:
    """Counts the bytes of a download and reports them to ``progress``."""

    def __init__(self, response: httpx.Response, progress: Progress | None) -> None:
        length = response.headers.get("content-length", "")
        self._total = int(length) if length.isdecimal() else None
        self._progress = progress
        self._done = 0

    def add(self, count: int) -> None:
        """Count ``count`` more bytes, and report."""
        self._done += count
        if self._progress is not None:
            self._progress(self._done, self._total)


def require_direct(connection: Any, url: str) -> None:
    """Refuse a connection that was redirected, before a token is sent over it.

    Raises ProtocolError if ``connection``, of websockets, is not one to ``url``.
    """
    found = connection.protocol.uri
    if found != parse_uri(url):
        place = f"{found.host}:{found.port}"
        raise ProtocolError("location", place, "absent: redirects are not followed")


def stream_options(url: str, *, timeout_s: float, threaded: bool = False) -> dict[str, Any]:
    """Return the options of a websockets client; ``threaded`` for one that reads on a thread."""
    options: dict[str, Any] = {
        "subprotocols": [Subprotocol(SUBPROTOCOL)],
        "user_agent_header": USER_AGENT,
        "logger": QUIET,
        "open_timeout": timeout_s,
        "close_timeout": _CLOSE_WITHIN_S,
        "max_size": MAX_SERVER_MESSAGE_BYTES,  # the default of 1 MiB is less than many a frame
        # Deflating a frame takes longer than sending it, and floats hardly shrink.
        "compression": None,
        # Credits bound the frames on their way, so this bounds only notices. A full queue stops
        # the reading of pongs, which would cut the connection of a slow reader.
        "max_queue": _QUEUED_MESSAGES,
    }
    return options | {"ssl": shared_context()} if threaded and url.startswith("wss:") else options
