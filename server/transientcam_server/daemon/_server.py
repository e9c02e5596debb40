"""The service as a process: its socket, its server, its signals."""

import asyncio
import ctypes
import gc
import logging
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AsyncExitStack, contextmanager
from functools import partial
from typing import Any, Final

import uvicorn
from fastapi import FastAPI

import transientcam_moments as tm
from transientcam.cli import INTERRUPTED
from transientcam.wire import MAX_CLIENT_MESSAGE_BYTES
from transientcam_driver import Camera
from transientcam_server import logs
from transientcam_server.daemon._acceptor import Acceptor
from transientcam_server.daemon._announcement import announced
from transientcam_server.daemon._connections import BoundedConnection
from transientcam_server.daemon._metering import CountingExecutor, counted
from transientcam_server.daemon._streams import BoundedStream
from transientcam_server.daemon._systemd import ServiceManager, supervised
from transientcam_server.errors import AddressUnavailable
from transientcam_server.imaging import BAND_BYTES
from transientcam_server.recording import DISK_THREADS
from transientcam_server.service import WORKER_THREADS, Service
from transientcam_server.settings import Settings

USER_TIMEOUT_MS: Final = 20_000
"""A client that acknowledges nothing for so long is gone, whatever the state of its WebSocket."""
NOTSENT_LOWAT_BYTES: Final = 128 * 1024
"""What the kernel keeps of a message beyond what is on the wire: frames wait here, not there."""
PING_S: Final = 10.0
SHUTDOWN_S: Final = 2
FREEZING_THREAD: Final = "freezing"
_BACKLOG = 4096
"""Connections that wait to be accepted; one more is dropped, and tried again after 1 s."""


def configure_logging(settings: Settings) -> None:
    """Log to standard error, one line a message."""
    logs.configure(level=settings.log_level, form=settings.log_format)


def listen(host: str, port: int) -> socket.socket:
    """Return a listening socket; its connections inherit its options.

    Raises AddressUnavailable if the address cannot be listened on.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
        try:
            _prepare(listener)
            listener.bind(address)
            listener.listen(_BACKLOG)
        except OSError:
            listener.close()
            raise
    except (OSError, UnicodeError) as error:  # the latter: no name of a host at all
        reason = getattr(error, "strerror", None) or str(error)
        raise AddressUnavailable(host, port, reason) from error
    return listener


def _prepare(listener: socket.socket) -> None:
    listener.setblocking(False)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for option, value in (
        ("TCP_USER_TIMEOUT", USER_TIMEOUT_MS),
        ("TCP_NOTSENT_LOWAT", NOTSENT_LOWAT_BYTES),
    ):
        if hasattr(socket, option):  # Linux; elsewhere the pings have to do
            listener.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)


def address(listener: socket.socket, *, tls: bool = False) -> str:
    """Return the URL of the service behind a listening socket."""
    scheme = "https" if tls else "http"
    host, port = listener.getsockname()[:2]
    if host in ("0.0.0.0", "::"):  # noqa: S104 - compared with, not bound to
        host = socket.gethostname()
    return f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"


class Server(uvicorn.Server):
    """uvicorn that reports when it listens, and closes streams before their connections."""

    def __init__(
        self, app: FastAPI, settings: Settings, *, on_listening: Callable[[], None]
    ) -> None:
        super().__init__(
            uvicorn.Config(
                app,
                lifespan="on",
                # a class would do as well, but could not be given its limits
                http=partial(BoundedConnection, limits=settings.limits),  # type: ignore[arg-type]
                ssl_certfile=settings.tls_certificate,
                ssl_keyfile=settings.tls_key,
                ws=partial(  # type: ignore[arg-type]
                    BoundedStream, limits=settings.limits, stream=settings.stream
                ),
                ws_per_message_deflate=False,  # 17 ms a frame for a tenth of its size
                ws_ping_interval=PING_S,
                ws_ping_timeout=PING_S,
                ws_max_size=MAX_CLIENT_MESSAGE_BYTES,
                log_config=None,
                log_level="info" if settings.log_level == "debug" else "warning",
                access_log=False,  # `requests` logs what it may: queries are not repeated
                server_header=False,
                proxy_headers=False,
                timeout_graceful_shutdown=SHUTDOWN_S,
            )
        )
        self._settings = settings
        self._service: Service = app.state.service
        self._around = AsyncExitStack()
        self._on_listening = on_listening
        self._acceptor: Acceptor | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, then report it."""
        asyncio.get_running_loop().set_default_executor(
            CountingExecutor(thread_name_prefix="requests")
        )
        self._service.recordings.disk.around = counted
        await super().startup([])  # it would accept without counting, and 1024 at once
        if self.started and sockets:
            self._acceptor = self._accept_from(sockets[0])
            self._acceptor.open()
            port = sockets[0].getsockname()[1]
            capabilities = self._service.camera.capabilities
            status = self._service.acquisition.status
            announcement = announced(
                self._settings, capabilities, port=port, state=lambda: status().state
            )
            await self._around.enter_async_context(announcement)
            manager = ServiceManager.of(os.environ)
            await self._around.enter_async_context(supervised(self._service.acquisition, manager))
        if self.started:
            self._on_listening()

    async def on_tick(self, counter: int) -> bool:
        """Do what is due every 0.1 s; a Date header has no words for the years from 10000 on."""
        try:
            return await super().on_tick(counter) or self._service.successor is not None
        except (ValueError, OverflowError):
            return self.should_exit

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Close every stream, then stop."""
        await self._around.aclose()
        if self._acceptor is not None:
            await self._acceptor.close()
        await self._service.close_streams()
        await super().shutdown(sockets)

    def _accept_from(self, listener: socket.socket) -> Acceptor:
        make: Any = self.config.http_protocol_class  # the one given above, by keywords
        protocol = partial(
            make,
            config=self.config,
            server_state=self.server_state,
            app_state=self.lifespan.state,
            _loop=asyncio.get_running_loop(),
        )
        return Acceptor(
            listener,
            protocol=protocol,
            limits=self._settings.limits,
            watched=lambda: self._service.watched,
            tls=self.config.ssl,
            offs=lambda: self._service.acquisition.offs,
        )

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Take SIGINT and SIGTERM as requests to end, and do not raise them again.

        uvicorn's own raises them once more at the end, which would kill this process before it
        closed its camera.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        handled = (signal.SIGINT, signal.SIGTERM)
        before = {each: signal.signal(each, self.handle_exit) for each in handled}
        try:
            yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)

    @property
    def signals(self) -> tuple[int, ...]:
        """Which signals ended it."""
        return tuple(self._captured_signals)


def serve_app(
    app: FastAPI, settings: Settings, listener: socket.socket, *, on_listening: Callable[[], None]
) -> tuple[str, Camera] | None:
    """Serve on a listening socket until a signal ends it; ``on_listening`` once it answers.

    Returns name and camera to go on with, if it ended for another one.
    Raises KeyboardInterrupt if the signal was SIGINT.
    """
    give_back_large_blocks()
    server = Server(app, settings, on_listening=on_listening)
    server.run(sockets=[listener.dup()])  # it closes what it is given
    service: Service = app.state.service
    successor = service.successor
    if server.signals and successor is not None:
        successor[1].close()
    if signal.SIGINT in server.signals:
        raise KeyboardInterrupt
    return None if server.signals else successor


def freeze_startup_objects(compiling: threading.Thread | None) -> threading.Thread:
    """Exempt what exists now from garbage collection, and again once ``compiling`` has ended.

    Returns the thread that waits for it.
    """
    gc.unfreeze()  # of the camera before
    _freeze()

    def wait() -> None:
        if compiling is not None:
            compiling.join()
            _freeze()

    waiting = threading.Thread(target=wait, name=FREEZING_THREAD, daemon=True)
    waiting.start()
    return waiting


def _freeze() -> None:
    gc.collect()
    gc.freeze()


@contextmanager
def exit_without_joining() -> Iterator[None]:
    """Do not wait, at the end of the block and of the process, for what no client waits for.

    A compiler that is at work cannot be interrupted, and takes longer for one kernel than a
    service manager waits for the process to end. What it has finished is on the disk; what it has
    not is lost in any case. Where nothing is at work the process ends as any other.
    """
    code = 0
    try:
        yield
    except KeyboardInterrupt:
        if not _left_behind():
            raise
        code = INTERRUPTED
    if _left_behind():
        logging.shutdown()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code)


def _left_behind() -> list[threading.Thread]:
    """Return threads that compile, compute what no client waits for, or wait for the disk."""
    names = (WORKER_THREADS, tm.kernels.THREAD, *DISK_THREADS)
    return [each for each in threading.enumerate() if each.name.startswith(names)]


_M_MMAP_THRESHOLD: Final = -3
"""Of glibc's malloc.h."""


def give_back_large_blocks() -> None:
    """Give each block of more than a band back to the system as soon as it is free.

    glibc's malloc does so by itself for blocks of 128 KiB at first, and for larger and larger ones
    as they are used: then they stay, in pieces (mallopt(3), M_MMAP_THRESHOLD). 100 answers of
    30 MiB left 190 MiB behind. Other systems' allocators have no such function, and are left alone.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, BAND_BYTES)
