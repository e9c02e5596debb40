"""Logs: text on a terminal, JSON elsewhere; each line names its request."""

import logging
import sys
from contextvars import ContextVar
from typing import Final, Literal, TextIO

from pythonjsonlogger.json import JsonFormatter

LogFormat = Literal["auto", "text", "json"]

request_id: Final[ContextVar[str | None]] = ContextVar("request_id", default=None)
"""The id of the request that is being answered; None outside of any."""

_NOISY: Final = ("websockets", "asyncio", "multipart", "PIL", "numba", "h5py", "httpcore")
"""Libraries whose own messages at `debug` are left out; some of them contain headers."""

_ROUTINE: Final = "httpx"
"""Logs at `info` each request that a relay makes of its origin."""

_CLIENT_MISTAKES: Final = frozenset(
    (
        "Invalid UTF-8 sequence received from client.",
        "ASGI callable returned without completing handshake.",
    )
)
"""Messages that uvicorn logs as errors, although the client made the mistake and was notified:
invalid text, and a stream that was refused."""


def configure(*, level: str, form: LogFormat, stream: TextIO = sys.stderr) -> None:
    """Log to ``stream``, one line a message."""
    handler = logging.StreamHandler(stream)
    chosen = form if form != "auto" else "text" if stream.isatty() else "json"
    handler.setFormatter(formatter(chosen))
    handler.addFilter(_add_request_id)
    handler.addFilter(_as_client_mistake)
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
    for name in _NOISY:
        logging.getLogger(name).setLevel(max(logging.INFO, logging.getLevelName(level.upper())))
    logging.getLogger(_ROUTINE).setLevel(logging.WARNING)


def formatter(form: Literal["text", "json"]) -> logging.Formatter:
    """Return the formatter of a log format."""
    if form == "text":
        return logging.Formatter("%(asctime)s %(levelname)-7s %(name)s: %(message)s")
    return JsonFormatter(
        "%(levelname)s %(name)s %(message)s",
        rename_fields={"levelname": "level", "name": "logger", "exc_info": "exception"},
        timestamp="time",
    )


def _add_request_id(record: logging.LogRecord) -> bool:
    current = request_id.get()
    if current is not None:
        record.request_id = current
    return True


def _as_client_mistake(record: logging.LogRecord) -> bool:
    if record.name != "uvicorn.error" or record.msg not in _CLIENT_MISTAKES:
        return True
    record.levelno, record.levelname, record.exc_info = logging.INFO, "INFO", None
    return logging.getLogger().isEnabledFor(logging.INFO)
