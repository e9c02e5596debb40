"""Requests that switch the light off, recognised before they are parsed: they go before all others.

Giving a lease back is among them: it ends what keeps others from controlling the light.
"""

import json
import re
from typing import Final

MOST_BYTES: Final = 8192
"""Head and body of a request that goes first; a longer one takes its turn."""
_TARGETS: Final = {
    b"POST": b"/api/v1/acquisition/safe-off",
    b"DELETE": b"/api/v1/lease",
    b"PUT": b"/api/v1/acquisition",  # where its body stops the capture
}
_BEGINS: Final = tuple(method + b" " for method in _TARGETS)
_LINE: Final = re.compile(rb"([A-Z]+) (?:https?://[^/\s]+)?(/[^?\s]*)(?:\?\S*)? HTTP/1\.[01]\r?")
_LENGTH: Final = re.compile(rb"\ncontent-length:[ \t]*(\d{1,4})[ \t]*\r?(?=\n|$)", re.IGNORECASE)
_IN_CHUNKS: Final = re.compile(rb"\ntransfer-encoding:", re.IGNORECASE)


def switches_off(begin: bytes) -> bool | None:
    """Return whether a request switches the light off; None while that cannot be known.

    It does once it is complete: what pretends to be one gains nothing by its first line. A proxy
    may have left any path of its own before that of the request.

    ``begin``: what has arrived of it, from its first byte on.
    """
    begin = begin.lstrip(b"\r\n")  # RFC 9112, 2.2
    if not any(begin.startswith(each) or each.startswith(begin) for each in _BEGINS):
        return False
    line, end, _ = begin.partition(b"\n")
    unknown = None if len(begin) < MOST_BYTES else False
    if not end:
        return unknown
    found = _LINE.fullmatch(line)
    if found is None or not found[2].endswith(_TARGETS.get(found[1], b" ")):
        return False
    head, end, body = begin.partition(b"\r\n\r\n")
    if not end:
        return unknown
    length = _LENGTH.search(head)
    if _IN_CHUNKS.search(head) or (length is None and b"\ncontent-length:" in head.lower()):
        return False
    length_bytes = 0 if length is None else int(length[1])
    if len(head) + length_bytes > MOST_BYTES:
        return False
    if len(body) < length_bytes:
        return None
    return found[1] != b"PUT" or _stops(body[:length_bytes])


def _stops(body: bytes) -> bool:
    try:
        wanted = json.loads(body)
    except (ValueError, RecursionError):
        return False
    return isinstance(wanted, dict) and wanted.get("running") is False
