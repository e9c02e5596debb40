"""One thread reads a TLS connection while others write and close it."""

import select
import socket
import ssl
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager

import pytest
import trustme

from transientcam.transport._tls import SharedSocket, shared_context

PATIENCE_S = 60.0
MEGABYTE = bytes(range(256)) * 4096


@pytest.fixture(scope="module")
def authority() -> trustme.CA:
    return trustme.CA()


@contextmanager
def echoing(authority: trustme.CA) -> Iterator[int]:
    """A server that sends back what it is sent, to one client, and tickets before."""
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    authority.issue_cert("127.0.0.1").configure_cert(context)

    def echo(listener: socket.socket) -> None:
        accepted, _ = listener.accept()
        with context.wrap_socket(accepted, server_side=True) as connection:
            try:
                while data := connection.recv(65536):
                    connection.sendall(data)
            except OSError:  # closed in the middle
                return

    with socket.create_server(("127.0.0.1", 0)) as listener, ThreadPoolExecutor(1) as executor:
        served = executor.submit(echo, listener)
        yield listener.getsockname()[1]
        served.result(PATIENCE_S)


@pytest.fixture
def shared(authority: trustme.CA) -> Iterator[SharedSocket]:
    """A connection on which tickets wait to be read, and no data."""
    context = shared_context()
    authority.configure_trust(context)
    with ExitStack() as stack:
        port = stack.enter_context(echoing(authority))
        plain = stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
        connection = stack.enter_context(context.wrap_socket(plain, server_hostname="127.0.0.1"))
        connection.settimeout(None)
        assert isinstance(connection, SharedSocket)
        assert connection.version() == "TLSv1.3"
        assert select.select([connection], [], [], PATIENCE_S)[0]
        yield connection


@pytest.fixture
def beside() -> Iterator[Callable[[Callable[[], bytes]], Callable[[], bytes]]]:
    """Starts something on a thread, and returns what waits for its end."""
    with ThreadPoolExecutor(1) as executor:

        def start(work: Callable[[], bytes]) -> Callable[[], bytes]:
            begun = threading.Event()

            def run() -> bytes:
                begun.set()
                return work()

            future = executor.submit(run)
            assert begun.wait(PATIENCE_S)
            return lambda: future.result(PATIENCE_S)

        yield start


Beside = Callable[[Callable[[], bytes]], Callable[[], bytes]]


def test_a_thread_that_waits_for_data_blocks_no_writer(
    shared: SharedSocket, beside: Beside
) -> None:
    reading = beside(lambda: shared.recv(65536))

    shared.sendall(b"hello")

    assert reading() == b"hello"


def test_a_waiting_reader_returns_when_another_thread_closes(
    shared: SharedSocket, beside: Beside
) -> None:
    def read() -> bytes:
        try:
            return shared.recv(65536)
        except OSError:
            return b""

    reading = beside(read)

    shared.close()

    assert reading() == b""


def test_megabytes_go_both_ways_at_once(shared: SharedSocket, beside: Beside) -> None:
    def read() -> bytes:
        data = b""
        while len(data) < 8 * len(MEGABYTE):
            data += shared.recv(65536)
        return data

    reading = beside(read)

    for _ in range(8):
        shared.sendall(MEGABYTE)

    assert reading() == 8 * MEGABYTE


def test_a_timeout_is_kept(shared: SharedSocket) -> None:
    shared.settimeout(0.01)

    assert shared.gettimeout() == 0.01
    with pytest.raises(TimeoutError):
        shared.recv(65536)


def test_after_half_a_shutdown_what_is_left_is_read_to_its_end(shared: SharedSocket) -> None:
    shared.shutdown(socket.SHUT_WR)

    while shared.recv(65536):
        pass
