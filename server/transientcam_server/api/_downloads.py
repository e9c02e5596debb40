"""Files as answers: whole, or the parts that a broken download still lacks."""

import asyncio
import logging
import os
import re
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import Header
from fastapi.responses import FileResponse, Response
from starlette.datastructures import Headers
from starlette.types import Receive, Scope, Send

from transientcam_server.errors import Problem, ProblemKind, kinds
from transientcam_server.recording import DiskThreads

_log = logging.getLogger("transientcam_server.api.downloads")
_PIECE: Final = 1024 * 1024
_RANGES: Final = re.compile(
    r"bytes=\s*({0}-{0}?|-{0})(\s*,\s*({0}-{0}?|-{0}))*\s*".replace("{0}", r"(\d{1,18})"), re.ASCII
)
Range = Annotated[
    str | None, Header(alias="range", description="which bytes, to go on with a broken download")
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
    """Return a file, or the range of it that is wanted; of several ranges all.

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
        _span(wanted, status.st_size),
        disk=disk,
        gone=gone,
        path=path,
        stat_result=status,
        headers=None if tag is None else {"ETag": tag},
        media_type=media_type,
        filename=filename,
    )


def part(data: bytes, wanted: str | None, *, media_type: str, tag: str) -> Response:
    """Return bytes, or the range of them that is wanted; of several ranges all.

    ``wanted``: the Range header, None also where If-Range names something else than ``tag``.
    Raises Problem ``range-not-satisfiable``.
    """
    headers = {"ETag": tag, "Accept-Ranges": "bytes"}
    span = _span(wanted, len(data))
    if span is None:
        return Response(data, media_type=media_type, headers=headers)
    begin, end = span
    headers["Content-Range"] = f"bytes {begin}-{end - 1}/{len(data)}"
    return Response(data[begin:end], 206, media_type=media_type, headers=headers)


def _deleted(gone: ProblemKind) -> Problem:
    return Problem(gone, "It was deleted meanwhile.")


def _span(wanted: str | None, size: int) -> tuple[int, int] | None:
    """Return begin and end of the range that is wanted; None for all. Refuse one beyond the end."""
    if wanted is None or not _RANGES.fullmatch(wanted.strip()):
        return None
    ranges = [each.strip().partition("-") for each in wanted.partition("=")[2].split(",")]
    if any(first and last and int(last) < int(first) for first, _, last in ranges):
        return None
    if any(int(first) >= size if first else not int(last) for first, _, last in ranges):
        detail = f"The file has {size} bytes."
        raise Problem(kinds.RANGE_NOT_SATISFIABLE, detail, field="range", value=wanted, limit=size)
    (first, _, last), *others = ranges
    begin = int(first) if first else max(0, size - int(last))
    return None if others else (begin, min(size, int(last) + 1) if first and last else size)


class _File(FileResponse):
    """A file, or a range of it, read on threads of the disk; the framework makes its headers."""

    def __init__(
        self, span: tuple[int, int] | None, *, disk: DiskThreads, gone: ProblemKind, **about: Any
    ) -> None:
        super().__init__(**about)
        self._span, self._disk, self._gone = span, disk, gone

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, once the beginning is read; the answer ends short where the disk then fails."""
        begin, end = 0, (size := int(self.headers["content-length"]))
        tags = (None, self.headers["etag"], self.headers["last-modified"])
        if self._span is not None and Headers(scope=scope).get("if-range") in tags:
            begin, end = self._span
            self.status_code = 206
            self.headers["content-range"] = f"bytes {begin}-{end - 1}/{size}"
            self.headers["content-length"] = str(end - begin)
        try:
            file = await self._disk.run(os.open, self.path, os.O_RDONLY)
        except FileNotFoundError:
            raise _deleted(self._gone) from None
        left = asyncio.create_task(_disconnected(receive))
        try:
            data = await self._disk.run(os.pread, file, min(_PIECE, end - begin), begin)
            head = {"status": self.status_code, "headers": self.raw_headers}
            await send({"type": "http.response.start", **head})
            while begin + len(data) < end and data and not left.done():
                await send({"type": "http.response.body", "body": data, "more_body": True})
                begin += len(data)
                data = await self._read_on(file, begin, end)
            if begin + len(data) == end:
                await send({"type": "http.response.body", "body": data})
        finally:
            left.cancel()
            self._disk.submit(os.close, file)

    async def _read_on(self, descriptor: int, begin: int, end: int) -> bytes:
        try:
            return await self._disk.run(os.pread, descriptor, min(_PIECE, end - begin), begin)
        except (OSError, Problem) as error:
            _log.warning("the rest of %s cannot be sent: %s", self.path, error)
            return b""


async def _disconnected(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
