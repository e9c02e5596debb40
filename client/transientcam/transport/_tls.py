"""TLS for a connection that one thread reads while others write."""

import contextlib
import selectors
import socket
import ssl
import threading
from collections.abc import Callable
from typing import Any, TypeVar

_Result = TypeVar("_Result")


class SharedSocket(ssl.SSLSocket):
    """A TLS socket whose reader never blocks writers, nor outlives ``close``.

    websockets reads on a thread as soon as there is something to read. Where that is no data but a
    session ticket, which TLS 1.3 sends after its handshake (RFC 8446, Sec. 4.6.1), an ordinary
    socket goes on reading inside OpenSSL, whose objects are for one thread at a time: about one
    connection in 300 lost what another thread wrote then, and could not be closed. Here no thread
    waits inside OpenSSL: one that has to wait releases the lock first.
    """

    _turn: "threading.Lock | None" = None
    """Held by the thread that is inside OpenSSL; None until the handshake is over."""
    _timeout_s: float | None = None

    def do_handshake(self, block: bool = False) -> None:
        """Perform the handshake; from then on no call blocks inside OpenSSL."""
        super().do_handshake(block)
        self._timeout_s = super().gettimeout()
        super().settimeout(0.0)
        self._turn = threading.Lock()

    def gettimeout(self) -> float | None:
        """Return how long `recv` and `send` wait; None is for ever."""
        return super().gettimeout() if self._turn is None else self._timeout_s

    def settimeout(self, value: float | None, /) -> None:
        """Set how long `recv` and `send` wait; None is for ever."""
        if self._turn is None:
            super().settimeout(value)
        else:
            self._timeout_s = value

    def recv(self, buflen: int = 1024, flags: int = 0) -> bytes:
        """Return data as soon as there is some; nothing at the end."""
        receive = super().recv
        return self._take_turns(lambda: receive(buflen, flags), selectors.EVENT_READ)

    def send(self, data: Any, flags: int = 0) -> int:
        """Send at least a part of ``data``, and return how much."""
        send = super().send
        return self._take_turns(lambda: send(data, flags), selectors.EVENT_WRITE)

    def close(self) -> None:
        """Close it; a thread that waits in `recv` returns."""
        with contextlib.suppress(OSError):  # it was never connected, or the other end is gone
            socket.socket.shutdown(self, socket.SHUT_RDWR)
        with self._turn or contextlib.nullcontext():
            super().close()

    def _take_turns(self, act: Callable[[], _Result], usual_event: int) -> _Result:
        if self._turn is None:
            return act()
        while True:
            with self._turn:
                try:
                    return act()
                except ssl.SSLWantReadError:
                    event = selectors.EVENT_READ
                except ssl.SSLWantWriteError:
                    event = selectors.EVENT_WRITE
                except BlockingIOError:  # after `shutdown`, which bypasses OpenSSL
                    event = usual_event
                # a handle of its own: the number of one that is closed meanwhile may be reused
                handle = socket.fromfd(self.fileno(), self.family, self.type)
            with handle, selectors.DefaultSelector() as selector:
                selector.register(handle, event)
                if not selector.select(self._timeout_s):
                    raise TimeoutError("timed out")


def shared_context() -> ssl.SSLContext:
    """Return a context that trusts the usual authorities, or those of ``SSL_CERT_FILE``."""
    context = ssl.create_default_context()
    context.sslsocket_class = SharedSocket
    return context
