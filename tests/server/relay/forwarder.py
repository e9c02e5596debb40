"""An address whose service can be exchanged, and whose connections can be cut."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from urllib.parse import urlsplit


class Forwarder:
    """Passes connections on to another address, as a proxy or a network between them does.

    Attributes
    ----------
    target
        The other address.
    delay_s
        How long after it came something is passed on.
    admitting
        Whether new connections are passed on; otherwise they are cut.
    seen
        The last bytes that came, from both sides, passed on or not.
    """

    def __init__(self, url: str) -> None:
        self.target = url
        self.delay_s = 0.0
        self.admitting = True
        self.seen = b""
        self._queues: list[SimpleQueue[tuple[float, bytes]]] = []
        self._closing = threading.Event()
        self._passing = threading.Event()
        self._passing.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._run(self._accept)

    @property
    def url(self) -> str:
        """Where clients connect."""
        return f"http://127.0.0.1:{self._listener.getsockname()[1]}"

    @property
    def waiting(self) -> int:
        """How many pieces came and are not passed on yet."""
        return sum(each.qsize() for each in list(self._queues))

    def silence(self) -> None:
        """Pass nothing on until `speak`: what is sent meanwhile waits, and nobody is told."""
        self._passing.clear()

    def speak(self) -> None:
        """Pass on what waits, and what comes."""
        self._passing.set()

    def cut(self) -> None:
        """Break every connection."""
        for each in self._open:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End all."""
        self._closing.set()
        self.speak()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.cut()
        for thread in self._threads:
            thread.join()
        for each in self._open:
            each.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            self._open.append(client)
            if not self.admitting:
                client.shutdown(socket.SHUT_RDWR)
                continue
            parts = urlsplit(self.target)
            try:
                service = socket.create_connection((parts.hostname, parts.port))
            except OSError:  # nothing is there at the moment
                client.shutdown(socket.SHUT_RDWR)
                continue
            self._open.append(service)
            self._run(self._pass_on, client, service)
            self._run(self._pass_on, service, client)

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        waiting: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
        self._queues.append(waiting)
        self._run(self._deliver, waiting, sink)
        with suppress(OSError):
            while data := source.recv(1 << 16):
                self.seen = (self.seen + data)[-(1 << 17) :]
                waiting.put((time.monotonic() + self.delay_s, data))
        waiting.put((0.0, b""))

    def _deliver(self, waiting: "SimpleQueue[tuple[float, bytes]]", sink: socket.socket) -> None:
        with suppress(OSError):
            while (item := waiting.get())[1]:
                self._closing.wait(max(0.0, item[0] - time.monotonic()))
                self._passing.wait()
                sink.sendall(item[1])
        self._queues.remove(waiting)  # what nobody takes any more
        with suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)

    def _run(self, function: object, *arguments: object) -> None:
        thread = threading.Thread(target=function, args=arguments, name="forwarder")  # type: ignore[arg-type]
        self._threads.append(thread)
        thread.start()


@contextmanager
def forwarding(url: str) -> Iterator[Forwarder]:
    """Forward to an address until the end of the block."""
    forwarder = Forwarder(url)
    try:
        yield forwarder
    finally:
        forwarder.close()
