"""The twins of `Camera` and `Stream` for asyncio."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Mapping, Sequence
from contextlib import AsyncExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import httpx
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Data

from transientcam.errors import ServerUnreachable, StreamClosed, TransientcamError
from transientcam.frame import Frame
from transientcam.lease import AsyncLease, OnLapse
from transientcam.requests import frames as frame_requests
from transientcam.requests import request as rest
from transientcam.requests.calibrations import Calibrations
from transientcam.requests.frames import Part, Which
from transientcam.requests.jobs import PROGRESS_EVERY_S, WAIT_S, Jobs, OnProgress, ended
from transientcam.stream_state import (
    DEFAULT_CREDITS,
    NoticeHandler,
    Reconnect,
    StreamState,
    reconnect_policy,
    subscribe_message,
)
from transientcam.transport.address import parse_address
from transientcam.transport.deadline import Deadline
from transientcam.transport.errors import translated
from transientcam.transport.options import (
    Progress,
    Told,
    answer,
    http_options,
    request_options,
    stream_options,
)
from transientcam.wire import LEASE_HEADER, Channel, CloseCode, Hello, Notice, Subscription

_T = TypeVar("_T")


class AsyncCamera:
    """A camera behind a daemon, for asyncio; see `Camera` for what each method does.

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
        self._address = parse_address(url)
        self._token = token
        self._timeout_s = timeout_s
        self._http = httpx.AsyncClient(
            **http_options(token=token, timeout_s=timeout_s), transport=transport
        )
        self._streams: list[AsyncStream] = []

    @property
    def url(self) -> str:
        """Address of the daemon."""
        return self._address.url

    async def info(self) -> dict[str, Any]:
        """Return what the daemon is: names and versions."""
        return await self._ask(rest.document("info"))

    async def camera(self) -> dict[str, Any]:
        """Return what the camera is, can do and does: capabilities and state."""
        return await self._ask(rest.document("camera"))

    async def sequence(self) -> dict[str, Any]:
        """Return what is captured: the sequence as it was really set."""
        return await self._ask(rest.document("sequence"))

    async def set_sequence(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Set the sequence, what is left out to its default, and return what was really set."""
        return await self._ask(rest.sequence(settings))

    async def configure(self, **changes: object) -> dict[str, Any]:
        """Change some fields of the sequence, keep the others, and return what was really set."""
        return await self._ask(rest.sequence({**await self.sequence(), **changes}))

    async def validate(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Return what a sequence would really be set to, without setting it."""
        return await self._ask(rest.sequence(settings, only_validate=True))

    async def reconstruction(self) -> dict[str, Any]:
        """Return how frames are computed: smoothing, biasing, estimator and thresholds."""
        return await self._ask(rest.document("reconstruction"))

    async def set_reconstruction(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Change how frames are computed, what is left out to its default."""
        return await self._ask(rest.reconstruction(settings))

    async def parameters(self) -> dict[str, Any]:
        """Return everything that can be set, with its value, unit and limits."""
        return await self._ask(rest.document("parameters"))

    @property
    def calibrations(self) -> Calibrations[Awaitable[dict[str, Any]], Awaitable[bytes]]:
        """The calibrations that the daemon keeps: to measure, use, export and take in."""
        return Calibrations(self._ask, self._ask)

    @property
    def jobs(self) -> Jobs[Awaitable[dict[str, Any]]]:
        """Long work of the daemon: how far it is, and how to end it."""
        return Jobs(self._ask)

    async def wait_for(
        self, job_id: str, *, on_progress: OnProgress | None = None
    ) -> dict[str, Any]:
        """Wait until a job is done or cancelled, and return its document."""
        wait_s = WAIT_S if on_progress is None else PROGRESS_EVERY_S
        while not ended(job := await self.jobs.get(job_id, wait_s=wait_s)):
            if on_progress is not None:
                on_progress(job)
        return job

    async def acquisition(self) -> dict[str, Any]:
        """Return whether the camera captures, and how fast."""
        return await self._ask(rest.document("acquisition"))

    async def start(self) -> dict[str, Any]:
        """Let the camera capture."""
        return await self._ask(rest.acquire(running=True))

    async def stop(self) -> dict[str, Any]:
        """Let the camera rest."""
        return await self._ask(rest.acquire(running=False))

    def lease(
        self,
        holder: str,
        *,
        duration_s: float = 30.0,
        on_lapse: OnLapse = "stop",
        takeover: bool = False,
    ) -> AsyncLease:
        """Return a block in which nobody else changes anything.

        ::

            async with camera.lease("alignment on bench 2"):
                await camera.configure(harmonics=4)

        It is renewed meanwhile. What this object changes is changed under the lease, also after
        it was lost: a `ProblemError` of type ``/problems/lease-lost`` says so then.

        Parameters
        ----------
        holder
            What to tell others who controls the camera.
        duration_s
            How long the lease lasts if this process dies.
        on_lapse
            Whether the capture, and with it the light, stops then.
        takeover
            Take it from whoever has it.
        """
        terms = {
            "holder": holder,
            "duration_s": duration_s,
            "on_lapse": on_lapse,
            "takeover": takeover,
        }
        return AsyncLease(self._ask, self._show_lease, terms)

    async def safe_off(self) -> dict[str, Any]:
        """Switch the light off, whoever holds the lease."""
        return await self._ask(rest.document("acquisition/safe-off", method="POST"))

    async def frames(self) -> dict[str, Any]:
        """Return which frames of the last seconds can be had, by their numbers."""
        return await self._ask(rest.document("frames"))

    async def timeline(self, recording: str) -> dict[str, Any]:
        """Return which frames a recording has, and when they were captured."""
        return await self._ask(frame_requests.timeline(recording))

    async def meta(
        self,
        *,
        number: int | None = None,
        recording: str | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> dict[str, Any]:
        """Return what is known of a frame; parameters as for `frame`."""
        return await self._ask(frame_requests.meta(Which(number, recording, wait_s, after)))

    async def latest(
        self, *, wait_s: float | None = None, after: int | None = None
    ) -> dict[str, Any]:
        """Return what is known of the newest frame; ``wait_s`` and ``after`` as for `frame`."""
        return await self.meta(wait_s=wait_s, after=after)

    async def frame(
        self,
        product: str,
        *,
        number: int | None = None,
        recording: str | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
        time_s: object = None,
        bins: int | None = None,
        y: int | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> Frame:
        """Return one product of the newest frame, or of another one; see `Camera.frame`."""
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return await self._ask(frame_requests.frame(product, which, part))

    async def file(
        self,
        product: str,
        form: str,
        *,
        colour: bool = False,
        number: int | None = None,
        recording: str | None = None,
        region: Sequence[int] | None = None,
        decimation: int | None = None,
        time_s: object = None,
        bins: int | None = None,
        y: int | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> bytes:
        """Return one product of a frame as a file; parameters as for `frame`.

        ``form`` is ``"png"``, ``"npy"``, ``"npz"``, ``"tiff"``, ``"ply"`` or ``"csv"``; not every
        product fits every one. ``colour`` makes a PNG for the eye.
        """
        which = Which(number, recording, wait_s, after)
        part = Part(time_s, bins, y, region, decimation)
        return await self._ask(frame_requests.file(product, form, which, part, colour=colour))

    async def picture(
        self,
        product: str,
        *,
        colour: bool = False,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> bytes:
        """Return one product of the newest frame as PNG: 16 bit (range in mm), or for the eye."""
        return await self.file(product, "png", colour=colour, wait_s=wait_s, after=after)

    async def pixel(
        self,
        *,
        x: int,
        y: int,
        bins: int | None = None,
        number: int | None = None,
        recording: str | None = None,
        wait_s: float | None = None,
        after: int | None = None,
    ) -> dict[str, Any]:
        """Return everything about one pixel of a frame; parameters as for `frame`."""
        which = Which(number, recording, wait_s, after)
        return await self._ask(frame_requests.pixel(which, x=x, y=y, bins=bins))

    async def simulation(self) -> dict[str, Any]:
        """Return what is simulated; a problem where the camera is real."""
        return await self._ask(rest.document("simulation"))

    async def simulate(
        self, scene: str | None = None, *, effects: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Put a simulated camera before a built-in scene; capturing goes on meanwhile.

        ``effects`` takes the place of all earlier choices: "auto", "on" or "off" by name.
        """
        return await self._ask(rest.simulation(scene, effects))

    async def cause(self, fault: str) -> dict[str, Any]:
        """Let something go wrong in the simulation: unplug, replug, corrupt-image, drop-image."""
        return await self._ask(rest.fault(fault))

    async def record(
        self,
        *,
        name: str | None = None,
        duration_s: float | None = None,
        frames: int | None = None,
        history_s: float | None = None,
        annotations: Mapping[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Let the daemon record raw frames, until a limit or `stop_recording`; describe it.

        With ``history_s`` it begins with the frames of the last seconds: what just happened.
        """
        return await self._ask(
            rest.record(
                name=name,
                duration_s=duration_s,
                frames=frames,
                history_s=history_s,
                annotations=annotations,
            )
        )

    async def recordings(self) -> dict[str, Any]:
        """Return all recordings of the daemon, the newest first."""
        return await self._ask(rest.document("recordings"))

    async def recording(self, recording_id: str) -> dict[str, Any]:
        """Describe a recording."""
        return await self._ask(rest.recording(recording_id))

    async def stop_recording(self, recording_id: str) -> dict[str, Any]:
        """End a recording, wait until it is on the disk, and describe it."""
        stop = rest.recording(recording_id, method="POST", part="/stop", patience_s=60.0)
        return await self._ask(stop)

    async def download_recording(
        self, recording_id: str, output: Path, *, progress: Progress | None = None
    ) -> None:
        """Fetch a recording's file; until it is whole it is called ``<output>.part``.

        ``progress`` is called with the bytes that came and with how many there are, if that is
        known.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        part = output.with_name(output.name + ".part")
        url = f"{self._address.api}/{rest.recording_file(recording_id)}"
        with translated(self.url):
            async with self._http.stream("GET", url) as response:
                if response.status_code != httpx.codes.OK:
                    await response.aread()
                    raise rest.problem(answer(response))
                told = Told(response, progress)
                with part.open("wb") as file:
                    async for piece in response.aiter_bytes():
                        told.wrote(file.write(piece))
        part.rename(output)

    def stream(
        self,
        *products: str | Subscription,
        on_notice: NoticeHandler | None = None,
        reconnect: bool | Reconnect = False,
        credits: int | None = DEFAULT_CREDITS,  # noqa: A002 - the protocol calls them so
        max_rate_hz: float | None = None,
        start: int | None = None,
    ) -> "AsyncStream":
        """Return a stream of frames as they are captured; enter it to have it closed."""
        subscribe = subscribe_message(
            products, token=self._token, credits=credits, max_rate_hz=max_rate_hz, start=start
        )
        state = StreamState(subscribe, on_notice=on_notice, reconnect=reconnect_policy(reconnect))
        stream = AsyncStream(self._address.stream, state, timeout_s=self._timeout_s)
        self._streams = [*(each for each in self._streams if not each.closed), stream]
        return stream

    async def close(self) -> None:
        """Close every connection and stream; the daemon goes on."""
        for stream in self._streams:
            await stream.close()
        await self._http.aclose()

    async def __aenter__(self) -> "AsyncCamera":
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<AsyncCamera {self.url}>"

    def _show_lease(self, lease_id: str | None) -> None:
        if lease_id is None:
            self._http.headers.pop(LEASE_HEADER, None)
        else:
            self._http.headers[LEASE_HEADER] = lease_id

    async def _ask(self, request: rest.Request[_T]) -> _T:
        with translated(self.url):
            response = await self._http.request(
                request.method,
                f"{self._address.api}/{request.path}",
                **request_options(request, timeout_s=self._timeout_s),
            )
        return request.result(answer(response))


class AsyncStream:
    """An asynchronous iterator of frames; made by `AsyncCamera.stream`, and read by one task.

    It connects when the first frame is asked for, or on entering it. Asking for the next frame
    tells the server that the one before is done with.
    """

    def __init__(self, url: str, state: StreamState, *, timeout_s: float) -> None:
        self._url = url
        self._state = state
        self._timeout_s = timeout_s
        self._stack = AsyncExitStack()
        self._connection: ClientConnection | None = None
        self._closed = asyncio.Event()

    @property
    def hello(self) -> Hello | None:
        """How the server greeted; None before the first connection."""
        return self._state.hello

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What frames look like at present: unit, axes, dtype and shape of each subscription."""
        return self._state.channels

    @property
    def sequence(self) -> Mapping[str, Any]:
        """What is captured at present: the applied sequence; empty before the first connection."""
        return self._state.sequence

    @property
    def notices(self) -> Sequence[Notice]:
        """The newest 256 notices, oldest first; see `Stream.notices`."""
        return self._state.notices

    @property
    def closed(self) -> bool:
        """Whether it was closed for good, here."""
        return self._closed.is_set()

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
        """Ask for other products from now on; frames already on their way still arrive."""
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

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
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
                connect(self._url, **stream_options(timeout_s=self._timeout_s))
            )
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
