"""A stream of frames as they are captured, read by a thread."""

import asyncio
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Data

from transientcam.errors import ServerUnreachable, StreamClosed, TransientcamError
from transientcam.frame import Frame
from transientcam.stream_state import DEFAULT_CREDITS, StreamState, subscribe_message
from transientcam.transport import Deadline, require_direct, stream_options, translated
from transientcam.wire import Channel, CloseCode, Hello, Notice, Subscription


class BaseStream:
    """What `Stream` and `AsyncStream` report of their state."""

    def __init__(
        self,
        url: str,
        state: StreamState,
        *,
        timeout_s: float,
        end: threading.Event | asyncio.Event,
    ) -> None:
        self._url = url
        self._state = state
        self._timeout_s = timeout_s
        self._end = end

    @property
    def closed(self) -> bool:
        """Whether this client has closed it for good."""
        return self._end.is_set()

    @property
    def hello(self) -> Hello | None:
        """The server's greeting; None before the first connection."""
        return self._state.hello

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Unit, axes, dtype and shape of the frames of each subscription at present."""
        return self._state.channels

    @property
    def sequence(self) -> Mapping[str, Any]:
        """The sequence that is captured at present; empty before the first connection."""
        return self._state.sequence

    @property
    def notices(self) -> Sequence[Notice]:
        """The newest 256 notices, oldest first.

        Beside those of docs/stream.md the client adds ``product-failed`` (with the problem),
        ``connection-lost`` (``reason``) and ``reconnected`` (``attempts``).
        """
        return self._state.notices


class Stream(BaseStream):
    """An iterator of frames; made by `Camera.stream`.

    It connects when the first frame is requested, or on entering it as a context manager. A loop
    over a stream that is not entered closes it when the loop is left. Requesting the next frame
    acknowledges the one before, so that a slow loop gets fewer but fresh frames.

    ``receive`` belongs to one thread; ``close`` may be called from any.
    """

    def __init__(self, url: str, state: StreamState, *, timeout_s: float) -> None:
        self._closed = threading.Event()
        super().__init__(url, state, timeout_s=timeout_s, end=self._closed)
        self._stack = ExitStack()
        self._connection: ClientConnection | None = None
        self._entered = False

    def receive(self, *, timeout_s: float | None = None) -> Frame:
        """Return the next frame, waiting for it.

        Raises
        ------
        FrameTimeout
            If none comes within ``timeout_s`` (None: waits as long as it takes).
        StreamClosed, ServerUnreachable
            If the connection is lost for good; code 1000 once this client has closed it.
        ProblemError
            If the server refuses the subscription.
        ProtocolError
            If what answers does not speak the protocol.
        """
        deadline = Deadline(timeout_s)
        while not self._closed.is_set():
            try:
                frame = self._state.received(self._message(deadline))
            except TransientcamError as error:
                self._recover(error, deadline)
            else:
                if frame is not None:
                    return frame
        raise StreamClosed(CloseCode.NORMAL, "it was closed here")

    def subscribe(
        self,
        *products: str | Subscription,
        credits: int | None = DEFAULT_CREDITS,  # noqa: A002 - the protocol calls them so
        max_rate_hz: float | None = None,
        start: int | None = None,
    ) -> None:
        """Subscribe to other products from now on, or from frame ``start`` on if it is kept.

        Frames that are already on their way still arrive.

        Raises
        ------
        ParameterError
            If there is no product, or a number is out of range.
        """
        message = subscribe_message(
            products, token=None, credits=credits, max_rate_hz=max_rate_hz, start=start
        )
        data = self._state.resubscribe(message)
        if self._connection is not None:
            with translated(self._url):
                self._connection.send(data)

    def close(self) -> None:
        """End the stream; a ``receive`` that waits in another thread ends with it."""
        self._closed.set()
        self._disconnect()

    def __enter__(self) -> "Stream":
        self._entered = True
        if self._connection is None:
            self._connect()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        try:
            while True:
                yield self.receive()
        except StreamClosed as error:
            if error.code != CloseCode.NORMAL:
                raise
        finally:
            if not self._entered:
                self.close()

    def _connect(self) -> ClientConnection:
        with translated(self._url):
            connection: ClientConnection = self._stack.enter_context(
                connect(
                    self._url, **stream_options(self._url, timeout_s=self._timeout_s, threaded=True)
                )
            )
            require_direct(connection, self._url)
            connection.send(self._state.opening(connection.subprotocol))
        if self.closed:  # meanwhile, by another thread
            raise StreamClosed(CloseCode.NORMAL, "it was closed here")
        self._connection = connection
        return connection

    def _disconnect(self) -> None:
        self._connection = None
        self._stack.close()

    def _message(self, deadline: Deadline) -> Data:
        connection = self._connection or self._connect()
        owed = self._state.acknowledgement()
        with translated(self._url):
            if owed is not None:
                connection.send(owed)
            try:
                return connection.recv(deadline.left_s())
            except TimeoutError:
                raise deadline.missed() from None

    def _recover(self, error: TransientcamError, deadline: Deadline) -> None:
        if self._connection is None or isinstance(error, StreamClosed | ServerUnreachable):
            self._disconnect()
        if self._closed.is_set():
            return
        wait_s = self._state.retry_after_s(error)
        if not deadline.allows(wait_s):
            raise deadline.missed() from error
        self._closed.wait(wait_s)
