"""The twins of `Camera` and `Stream` for asyncio."""

import asyncio
from collections.abc import AsyncIterator, Coroutine, Mapping
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Data

from transientcam.base_camera import BaseCamera
from transientcam.errors import ServerUnreachable, StreamClosed, TransientcamError
from transientcam.frame import Frame
from transientcam.lease import AsyncLease
from transientcam.requests import (
    MOST_DOCUMENT_BYTES,
    PROGRESS_EVERY_S,
    WAIT_S,
    OnProgress,
    Request,
    document,
    ended,
    problem,
    recording_path,
)
from transientcam.stream import BaseStream
from transientcam.stream_state import DEFAULT_CREDITS, StreamState, subscribe_message
from transientcam.transport import (
    Deadline,
    DownloadProgress,
    Progress,
    exchange_async,
    http_client,
    read_async,
    require_direct,
    require_plain,
    set_lease,
    stream_options,
    translated,
)
from transientcam.wire import CloseCode, Subscription

_T = TypeVar("_T")
_Document = Coroutine[Any, Any, dict[str, Any]]
_Frame = Coroutine[Any, Any, Frame]
_Bytes = Coroutine[Any, Any, bytes]


class AsyncCamera(BaseCamera[_Document, _Frame, _Bytes, AsyncLease, "AsyncStream"]):
    """A camera behind a daemon, for asyncio; see `Camera` for its parameters and errors.

    ::

        async with transientcam.AsyncCamera("http://127.0.0.1:8000") as camera:
            range_m = (await camera.frame("range")).array
            async with camera.stream("range", "coefficients") as stream:
                async for frame in stream:
                    ...
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        timeout_s: float = 10.0,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        super().__init__(url, token=token, timeout_s=timeout_s)
        self._http = http_client(
            httpx.AsyncClient, token=token, timeout_s=timeout_s, transport=transport
        )

    async def info(self) -> dict[str, Any]:
        """Return names and versions of the daemon."""
        return await self._ask(document("info"))

    async def camera(self) -> dict[str, Any]:
        """Return capabilities and state of the camera."""
        return await self._ask(document("camera"))

    async def sequence(self) -> dict[str, Any]:
        """Return the sequence that is captured, as it was really set."""
        return await self._ask(document("sequence"))

    async def set_sequence(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Set the sequence, absent fields to their defaults, and return what was really set."""
        return await self._ask(document("sequence", method="PUT", body=settings))

    async def configure(self, **changes: object) -> dict[str, Any]:
        """Change some fields of the sequence, keep the others, and return what was really set."""
        wanted = {**await self.sequence(), **changes}
        return await self._ask(document("sequence", method="PUT", body=wanted))

    async def reconstruction(self) -> dict[str, Any]:
        """Return how frames are computed: smoothing, biasing, estimator and thresholds."""
        return await self._ask(document("reconstruction"))

    async def set_reconstruction(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Change how frames are computed, absent fields to their defaults."""
        return await self._ask(document("reconstruction", method="PUT", body=settings))

    async def parameters(self) -> dict[str, Any]:
        """Return all parameters, with their values, units and limits."""
        return await self._ask(document("parameters"))

    async def wait_for(
        self, job_id: str, *, on_progress: OnProgress | None = None
    ) -> dict[str, Any]:
        """Wait until a job is done or cancelled, and return its document; see `Camera.wait_for`."""
        wait_s = WAIT_S if on_progress is None else PROGRESS_EVERY_S
        while not ended(job := await self.jobs.get(job_id, wait_s=wait_s)):
            if on_progress is not None:
                on_progress(job)
        return job

    async def acquisition(self) -> dict[str, Any]:
        """Return whether the camera captures, and how fast."""
        return await self._ask(document("acquisition"))

    async def frames(self) -> dict[str, Any]:
        """Return the numbers of the frames of the last seconds that the daemon still has."""
        return await self._ask(document("frames"))

    async def simulation(self) -> dict[str, Any]:
        """Return the simulated scene and effects; a `ProblemError` if the camera is real."""
        return await self._ask(document("simulation"))

    async def download_recording(
        self, recording_id: str, output: Path, *, progress: Progress | None = None
    ) -> None:
        """Download a recording's file; see `Camera.download_recording`."""
        part = output.with_name(output.name + ".part")
        url = f"{self._address.api}/{recording_path(recording_id)}/file"
        with translated(self.url):
            async with self._http.stream("GET", url) as response:
                if response.status_code != httpx.codes.OK:
                    raise problem(await read_async(response, most_bytes=MOST_DOCUMENT_BYTES))
                require_plain(response)
                received = DownloadProgress(response, progress)
                with part.open("wb") as file:
                    async for piece in response.aiter_bytes():
                        received.add(file.write(piece))
        part.rename(output)

    async def close(self) -> None:
        """Close every connection and stream; the daemon keeps running."""
        for stream in self._streams:
            await stream.close()
        await self._http.aclose()

    async def __aenter__(self) -> "AsyncCamera":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _ask(self, request: Request[_T]) -> _T:
        with translated(self.url):
            url = f"{self._address.api}/{request.path}"
            answer = await exchange_async(self._http, url, request, timeout_s=self._timeout_s)
        return request.result(answer)

    def _leased(self, terms: dict[str, Any]) -> AsyncLease:
        return AsyncLease(self._ask, partial(set_lease, self._http.headers), terms)

    def _streaming(self, state: StreamState) -> "AsyncStream":
        return AsyncStream(self._address.stream, state, timeout_s=self._timeout_s)


class AsyncStream(BaseStream):
    """An asynchronous iterator of frames; made by `AsyncCamera.stream`, and read by one task.

    It connects when the first frame is requested, or on entering it. Requesting the next frame
    acknowledges the one before.
    """

    def __init__(self, url: str, state: StreamState, *, timeout_s: float) -> None:
        self._closed = asyncio.Event()
        super().__init__(url, state, timeout_s=timeout_s, end=self._closed)
        self._stack = AsyncExitStack()
        self._connection: ClientConnection | None = None

    async def receive(self, *, timeout_s: float | None = None) -> Frame:
        """Return the next frame, waiting for it; raises what `Stream.receive` raises."""
        deadline = Deadline(timeout_s)
        while not self.closed:
            try:
                frame = self._state.received(await self._message(deadline))
            except TransientcamError as error:
                await self._recover(error, deadline)
            else:
                if frame is not None:
                    return frame
        raise StreamClosed(CloseCode.NORMAL, "it was closed here")

    async def subscribe(
        self,
        *products: str | Subscription,
        credits: int | None = DEFAULT_CREDITS,  # noqa: A002 - the protocol calls them so
        max_rate_hz: float | None = None,
        start: int | None = None,
    ) -> None:
        """Subscribe to other products from now on; see `Stream.subscribe`."""
        message = subscribe_message(
            products, token=None, credits=credits, max_rate_hz=max_rate_hz, start=start
        )
        data = self._state.resubscribe(message)
        if self._connection is not None:
            with translated(self._url):
                await self._connection.send(data)

    async def close(self) -> None:
        """End the stream; a ``receive`` that waits in another task ends with it."""
        self._closed.set()
        await self._disconnect()

    async def __aenter__(self) -> "AsyncStream":
        if self._connection is None:
            await self._connect()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def __aiter__(self) -> AsyncIterator[Frame]:
        try:
            while True:
                yield await self.receive()
        except StreamClosed as error:
            if error.code != CloseCode.NORMAL:
                raise

    async def _connect(self) -> ClientConnection:
        with translated(self._url):
            connection: ClientConnection = await self._stack.enter_async_context(
                connect(self._url, **stream_options(self._url, timeout_s=self._timeout_s))
            )
            require_direct(connection, self._url)
            await connection.send(self._state.opening(connection.subprotocol))
        if self.closed:  # meanwhile, by another task
            raise StreamClosed(CloseCode.NORMAL, "it was closed here")
        self._connection = connection
        return connection

    async def _disconnect(self) -> None:
        self._connection = None
        await self._stack.aclose()

    async def _message(self, deadline: Deadline) -> Data:
        connection = self._connection or await self._connect()
        owed = self._state.acknowledgement()
        with translated(self._url):
            if owed is not None:
                await connection.send(owed)
            try:
                async with asyncio.timeout(deadline.left_s()):
                    return await connection.recv()
            except TimeoutError:
                raise deadline.missed() from None

    async def _recover(self, error: TransientcamError, deadline: Deadline) -> None:
        if self._connection is None or isinstance(error, StreamClosed | ServerUnreachable):
            await self._disconnect()
        if self.closed:
            return
        wait_s = self._state.retry_after_s(error)
        if not deadline.allows(wait_s):
            raise deadline.missed() from error
        try:
            async with asyncio.timeout(wait_s):
                await self._closed.wait()
        except TimeoutError:
            pass
