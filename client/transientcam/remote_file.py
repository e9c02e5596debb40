"""A file behind HTTP that is read in pieces, as far as it is needed."""

import io
from collections import OrderedDict
from typing import Final

import httpx

from transientcam.errors import ProtocolError
from transientcam.requests import MOST_DOCUMENT_BYTES, problem
from transientcam.transport import bounded, http_client, read, translated, within, without_secrets

_BLOCK_BYTES: Final = 16 * 1024
"""What reads less than that gets a whole block; what reads more gets no byte beside."""
_BLOCKS: Final = 2048


class SizedFile(io.RawIOBase):
    """A file of a known size that can be read from any place; a subclass has ``readinto``."""

    size_bytes = 0
    _place = 0

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a place, and return it."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self.size_bytes}[whence]
        self._place = max(0, start + offset)
        return self._place


class RemoteFile(SizedFile):
    """A file on a server that answers with ranges; it keeps what was read last, up to 32 MiB.

    ``url``: of the file.
    ``token``: bearer token, where the server requires one.
    ``timeout_s``: how long to wait for each answer, all of it.
    ``transport``: how httpx sends requests, for tests and unusual networks.
    Raises ServerUnreachable, ProblemError if there is no such file, as of every read.
    Raises ProtocolError if the server has no ranges, or the file changed while it was open, as of
    every read.
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        timeout_s: float = 10.0,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        super().__init__()
        self._url = url
        self.url = without_secrets(url)
        """Of the file, as it may be shown."""
        self._timeout_s = timeout_s
        self._http = bounded(
            http_client(httpx.Client, token=token, timeout_s=timeout_s, transport=transport)
        )
        self._blocks: OrderedDict[int, bytes] = OrderedDict()
        self._tag: str | None = None
        try:
            self._block(0)
        except BaseException:
            self.close()
            raise

    def readinto(self, buffer: "memoryview[int]") -> int:  # type: ignore[override]  # a buffer
        """Fill a buffer as far as the file goes; return how many bytes that were."""
        view = memoryview(buffer).cast("B")
        done = 0
        while done < len(view) and self._place < self.size_bytes:
            piece = self._piece(min(len(view) - done, self.size_bytes - self._place))
            view[done : done + len(piece)] = piece
            done += len(piece)
            self._place += len(piece)
        return done

    def close(self) -> None:
        """Close the connection."""
        if not self.closed:
            self._http.close()
        super().close()

    def _piece(self, wanted: int) -> bytes:
        """Return bytes from the present place on, ``wanted`` of them or fewer."""
        number, begin = divmod(self._place, _BLOCK_BYTES)
        if wanted <= _BLOCK_BYTES or number in self._blocks:
            return self._block(number)[begin : begin + wanted]
        piece = self._request(self._place, wanted)
        place = self._place
        for inside in range(-(-place // _BLOCK_BYTES), (place + wanted) // _BLOCK_BYTES):
            first = inside * _BLOCK_BYTES - place
            self._keep(inside, piece[first : first + _BLOCK_BYTES])
        return piece

    def _block(self, number: int) -> bytes:
        found = self._blocks.get(number)
        if found is None:
            found = self._request(number * _BLOCK_BYTES, _BLOCK_BYTES)
        self._keep(number, found)
        return found

    def _keep(self, number: int, block: bytes) -> None:
        self._blocks[number] = block
        self._blocks.move_to_end(number)
        while len(self._blocks) > _BLOCKS:
            self._blocks.popitem(last=False)

    def _request(self, first: int, size: int) -> bytes:
        headers = {"range": f"bytes={first}-{first + size - 1}"}
        if self._tag is not None:
            headers["if-range"] = self._tag
        with (
            translated(self.url),
            within(self._timeout_s),
            self._http.stream("GET", self._url, headers=headers) as response,
        ):
            if response.status_code == httpx.codes.OK:  # the whole file, which is not read
                limit = "the part requested" if self._tag is None else "the file that was opened"
                raise ProtocolError("answer", "the whole of a file", limit)
            partial = response.status_code == httpx.codes.PARTIAL_CONTENT
            answer = read(response, most_bytes=size if partial else MOST_DOCUMENT_BYTES)
        if not partial:
            raise problem(answer)
        _, _, total = response.headers.get("content-range", "").partition("/")
        if not total.isdecimal():
            raise ProtocolError("content-range", total, "bytes first-last/size")
        self.size_bytes, self._tag = int(total), response.headers.get("etag")
        if len(answer.body) != min(size, self.size_bytes - first):
            raise ProtocolError("answer", f"{len(answer.body)} bytes", "those requested")
        return answer.body
