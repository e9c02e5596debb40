"""A TCP relay that lets only so many bytes a second through, as a thin link does."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

_PIECE_BYTES = 16 * 1024


class ThinLink:
    """Relays connections to a service; of what the service sends, `rate_bytes_s` at most.

    Attributes
    ----------
    rate_bytes_s
        Shared by all connections, and free to change at any time; None for no limit.
    """

    def __init__(self, url: str) -> None:
        target = urlsplit(url)
        self._host, self._port = str(target.hostname), int(target.port or 80)
        self.rate_bytes_s: float | None = None
        self.url = ""
        self._free_s = 0.0
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._end = asyncio.Event()

    @contextmanager
    def running(self) -> Iterator["ThinLink"]:
        """Relay on a thread of its own until the end of the block."""
        thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),))
        thread.start()
        self._ready.wait()
        try:
            yield self
        finally:
            self._loop.call_soon_threadsafe(self._end.set)
            thread.join()
            self._loop.close()

    async def _serve(self) -> None:
        relays: set[asyncio.Task[None]] = set()

        def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            relays.add(asyncio.ensure_future(self._relay(reader, writer)))

        server = await asyncio.start_server(accept, "127.0.0.1", 0)
        self.url = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        self._ready.set()
        await self._end.wait()
        server.close()
        for relay in relays:
            relay.cancel()
        await asyncio.gather(*relays, return_exceptions=True)

    async def _relay(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        from_service, to_service = await asyncio.open_connection(self._host, self._port)
        try:
            async with asyncio.TaskGroup() as both:
                both.create_task(self._copy(reader, to_service, paced=False))
                both.create_task(self._copy(from_service, writer, paced=True))
        except* ConnectionError:
            pass  # one end is gone, and so the other
        finally:
            for each in (writer, to_service):
                each.close()

    async def _copy(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, paced: bool
    ) -> None:
        while piece := await reader.read(_PIECE_BYTES):
            if paced:
                await self._pass(len(piece))
            writer.write(piece)
            await writer.drain()
        writer.close()

    async def _pass(self, size_bytes: int) -> None:
        rate_bytes_s = self.rate_bytes_s
        if rate_bytes_s is None:
            self._free_s = 0.0
            return
        now_s = self._loop.time()
        self._free_s = max(now_s, self._free_s) + size_bytes / rate_bytes_s
        await asyncio.sleep(self._free_s - now_s)
