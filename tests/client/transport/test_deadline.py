"""Deadlines."""

from transientcam.transport import Deadline


def test_a_deadline_runs_by_its_clock_and_never_below_zero() -> None:
    now_s = [100.0]
    deadline = Deadline(3.0, clock=lambda: now_s[0])
    left = []
    for time_s in (100.0, 101.0, 105.0):
        now_s[0] = time_s
        left.append(deadline.left_s())

    assert left == [3.0, 2.0, 0.0]
    assert str(deadline.missed()) == "No frame came within 3 s"


def test_a_wait_is_allowed_that_ends_before_the_deadline() -> None:
    deadline = Deadline(3.0, clock=lambda: 0.0)

    assert deadline.allows(2.9)
    assert not deadline.allows(3.0)


def test_no_timeout_is_no_end() -> None:
    deadline = Deadline(None)

    assert deadline.left_s() is None
    assert deadline.allows(1e9)
