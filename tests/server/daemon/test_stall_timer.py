from typing import Any, cast

from transientcam_server.daemon.connections import StallTimer

LIMIT_S = 20.0


class Timer:
    """One that rings when told to."""

    def __init__(self, delay_s: float, ring: Any) -> None:
        self.delay_s = delay_s
        self.ring = ring
        self.cancelled = False

    def cancel(self) -> None:
        self.cancelled = True


class Connection:
    """A loop and a transport with so many bytes left to write."""

    def __init__(self, left_bytes: int) -> None:
        self.left_bytes = left_bytes
        self.aborted = False
        self.timers: list[Timer] = []

    def call_later(self, delay_s: float, ring: Any) -> Timer:
        self.timers.append(Timer(delay_s, ring))
        return self.timers[-1]

    def get_write_buffer_size(self) -> int:
        return self.left_bytes

    def abort(self) -> None:
        self.aborted = True

    def wait(self) -> None:
        """Let the time of the last timer pass."""
        assert not self.timers[-1].cancelled
        assert self.timers[-1].delay_s == LIMIT_S
        self.timers[-1].ring()


def patience(connection: Connection) -> StallTimer:
    return StallTimer(cast("Any", connection), limit_s=LIMIT_S, loop=cast("Any", connection))


def test_a_connection_that_takes_nothing_is_cut() -> None:
    connection = Connection(100_000)
    patience(connection).begin()
    connection.wait()

    assert connection.aborted


def test_one_that_takes_a_little_is_waited_for_until_it_takes_nothing() -> None:
    connection = Connection(100_000)
    patience(connection).begin()
    for left_bytes in (99_999, 50_000, 10):
        connection.left_bytes = left_bytes
        connection.wait()
        assert not connection.aborted
    connection.wait()

    assert connection.aborted


def test_one_to_which_only_more_was_added_took_nothing() -> None:
    connection = Connection(100_000)
    patience(connection).begin()
    connection.left_bytes += 6  # a ping
    connection.wait()

    assert connection.aborted


def test_nothing_happens_once_everything_is_taken() -> None:
    connection = Connection(100_000)
    waiting = patience(connection)
    waiting.begin()
    waiting.end()
    waiting.end()

    assert connection.timers[0].cancelled
    assert not connection.aborted


def test_each_time_counts_for_itself() -> None:
    connection = Connection(100_000)
    waiting = patience(connection)
    waiting.begin()
    waiting.begin()

    assert [timer.cancelled for timer in connection.timers] == [True, False]
