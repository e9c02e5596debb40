"""Files as answers: whole, or the parts that a broken download still lacks."""

import os
import re
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import Header
from fastapi.responses import FileResponse, Response
from starlette.types import Message, Receive, Scope, Send

from transientcam_server.errors import Problem, ProblemKind, kinds
from transientcam_server.recording import DiskThreads

_RANGES: Final = re.compile(
    r"bytes=\s*({0}-{0}?|-{0})(\s*,\s*({0}-{0}?|-{0}))*\s*".replace("{0}", r"(\d{1,18})"), re.ASCII
)
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


async def answer(
    path: Path,
    wanted: str | None,
    *,
    disk: DiskThreads,
    gone: ProblemKind,
    media_type: str,
    filename: str | None = None,
    tag: str | None = None,
) -> FileResponse:
    """Return a file, or the range of it that is wanted.

    A header that is no range is ignored, as RFC 9110 (Sec. 14.2) has it.

    Parameters
    ----------
    disk
        Where it is waited for.
    gone
        What a file that was deleted since it was found is answered with.
    filename
        What to keep it as; None for what is no download.
    tag
        Its ETag; None for one made of its time and size.

    Raises
    ------
    Problem
        ``disk-stalled``, ``range-not-satisfiable``, or ``gone``; the latter also while the answer
        is sent.
    """
    try:
        status = await disk.run(path.stat)
    except FileNotFoundError:
        raise _deleted(gone) from None
    return _File(
        path,
        status,
        gone=gone,
        headers=None if tag is None else {"ETag": tag},
        media_type=media_type,
        filename=filename,
        ranges=_is_usable(wanted, status.st_size),
    )


def part(data: bytes, wanted: str | None, *, media_type: str, tag: str) -> Response:
    """Return bytes, or the range of them that is wanted; of several ranges all.

    Parameters
    ----------
    wanted
        The Range header, None also where If-Range names something else than ``tag``.

    Raises
    ------
    Problem
        ``range-not-satisfiable``.
    """
    headers = {"ETag": tag, "Accept-Ranges": "bytes"}
    size = len(data)
    if wanted is None or "," in wanted or not _is_usable(wanted, size):
        return Response(data, media_type=media_type, headers=headers)
    first, _, last = (each.strip() for each in wanted.partition("=")[2].partition("-"))
    begin = int(first) if first else max(0, size - int(last))
    end = min(size, int(last) + 1) if first and last else size
    headers["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
    return Response(data[begin:end], 206, media_type=media_type, headers=headers)


def _deleted(gone: ProblemKind) -> Problem:
    return Problem(gone, "It was deleted meanwhile.")


def _is_usable(wanted: str | None, size: int) -> bool:
    """Return whether a Range header is one; refuse one that lies beyond the end."""
    if wanted is None or not _RANGES.fullmatch(wanted.strip()):
        return False
    ranges = [each.strip().partition("-") for each in wanted.partition("=")[2].split(",")]
    if any(first and last and int(last) < int(first) for first, _, last in ranges):
        return False
    if any(int(first) >= size if first else not int(last) for first, _, last in ranges):
        detail = f"The file has {size} bytes."
        raise Problem(kinds.RANGE_NOT_SATISFIABLE, detail, field="range", value=wanted, limit=size)
    return True


class _File(FileResponse):
    """A file, in larger pieces than the framework's 64 KiB."""

    chunk_size = 1024 * 1024

    def __init__(
        self,
        path: Path,
        status: os.stat_result,
        *,
        gone: ProblemKind,
        headers: dict[str, str] | None,
        media_type: str,
        filename: str | None,
        ranges: bool,
    ) -> None:
        super().__init__(
            path, headers=headers, media_type=media_type, filename=filename, stat_result=status
        )
        self._gone, self._ranges = gone, ranges

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer; the framework would refuse a header that is no range.

        It also begins an answer before it opens the file, which may be gone by then.
        """
        if not self._ranges:
            headers = [each for each in scope["headers"] if each[0] != b"range"]
            scope = {**scope, "headers": headers}
        begun: list[Message] = []

        async def send_once_open(message: Message) -> None:
            if message["type"] == "http.response.start":
                begun.append(message)
                return
            while begun:
                await send(begun.pop())
            await send(message)

        try:
            await super().__call__(scope, receive, send_once_open)
        except FileNotFoundError:
            raise _deleted(self._gone) from None
