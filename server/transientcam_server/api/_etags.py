"""Changing what one has read, and only that: ETag, If-Match and If-None-Match."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import Header

from transientcam_server.errors import Problem, ProblemKind

IfMatch = Annotated[
    str | None, Header(description="change it only if what is in use has this `ETag`")
]
IfNoneMatch = Annotated[str | None, Header(description="the `ETag` of what the client has already")]
_HEADERS: Final[dict[str, Any]] = {
    "ETag": {"description": "names this very document", "schema": {"type": "string"}}
}
READING: Final[dict[int | str, dict[str, Any]]] = {
    200: {"headers": _HEADERS},
    304: {"description": "It is still the one that If-None-Match names", "content": {}},
}
"""What the OpenAPI document states of a route that reads."""
CHANGING: Final[dict[int | str, dict[str, Any]]] = {200: {"headers": _HEADERS}}
"""The same of one that changes."""


def etag(document: Mapping[str, Any]) -> str:
    """Return what names a document."""
    return of_bytes(json.dumps(document, sort_keys=True).encode())


def of_bytes(content: bytes) -> str:
    """Return what names some bytes."""
    return f'"{hashlib.sha256(content).hexdigest()[:16]}"'


def of_file(path: Path) -> str:
    """Return what names the content of a file, by when and how long it was written.

    Raises OSError if it is gone.
    """
    found = path.stat()
    return of_bytes(f"{found.st_ino} {found.st_mtime_ns} {found.st_size}".encode())


def names(header: str | None, tag: str) -> bool:
    """Return whether an If-Match or If-None-Match header is about this tag."""
    given = {each.strip().removeprefix("W/") for each in (header or "").split(",")}
    return "*" in given or tag in given


def require(if_match: str | None, tag: str, *, otherwise: ProblemKind) -> None:
    """Refuse a change of something that is not in use any more.

    Raises Problem of the kind ``otherwise``.
    """
    if if_match is not None and not names(if_match, tag):
        raise Problem(
            otherwise, f"{otherwise.title}.", field="If-Match", value=if_match, current=tag
        )
