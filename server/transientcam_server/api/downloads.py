"""Files as answers: whole, or the parts that a broken download still lacks."""

import asyncio
import re
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import Header
from fastapi.responses import FileResponse

from transientcam_server.errors import Problem, kinds

_RANGES: Final = re.compile(r"bytes=\s*(\d+-\d*|-\d+)(\s*,\s*(\d+-\d*|-\d+))*\s*", re.ASCII)
Range = Annotated[
    str | None,
    Header(alias="range", description="which bytes, to go on with a broken download"),
]


def documented_file(media_type: str) -> dict[int | str, dict[str, Any]]:
    """Return what the OpenAPI document says of an answer that is a file."""
    return {
        200: {"description": "the whole file", "content": {media_type: {}}},
        206: {"description": "the requested bytes", "content": {media_type: {}}},
    }


async def answer(path: Path, wanted: str | None, *, media_type: str, filename: str) -> FileResponse:
    """Return a file, or the range of it that is wanted.

    Raises
    ------
    Problem
        ``invalid-request`` or ``range-not-satisfiable``.
    """
    _check_range(wanted, (await asyncio.to_thread(path.stat)).st_size)
    return _File(path, media_type=media_type, filename=filename)


def _check_range(wanted: str | None, size: int) -> None:
    """Refuse ranges that cannot be served, which would be answered with plain text."""
    if wanted is None:
        return
    if not _RANGES.fullmatch(wanted.strip()):
        limit = "bytes=first-last"
        raise Problem(
            kinds.INVALID_REQUEST,
            "The range is no range.",
            field="range",
            value=wanted,
            limit=limit,
        )
    for each in wanted.partition("=")[2].split(","):
        first, _, last = each.strip().partition("-")
        if (first and int(first) >= size) or (not first and not int(last)):
            detail = f"The file has {size} bytes."
            raise Problem(
                kinds.RANGE_NOT_SATISFIABLE, detail, field="range", value=wanted, limit=size
            )
        if first and last and int(last) < int(first):
            raise Problem(
                kinds.INVALID_REQUEST,
                "The range ends before it begins.",
                field="range",
                value=wanted,
                limit="bytes=first-last",
            )


class _File(FileResponse):
    """A file, in larger pieces than the framework's 64 KiB."""

    chunk_size = 1024 * 1024

    def __init__(self, path: Path, *, media_type: str, filename: str) -> None:
        super().__init__(path, media_type=media_type, filename=filename)
