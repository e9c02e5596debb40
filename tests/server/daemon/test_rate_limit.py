from hypothesis import given, strategies as st

from transientcam_server.daemon._rate_limit import BURST_S, MOST_ANSWERS, RateLimiter


class Clock:
    """A clock that the test sets."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_a_burst_is_allowed_and_then_no_more() -> None:
    rate_limiter = RateLimiter(10.0, clock=Clock())

    allowed = [rate_limiter.allow() for _ in range(25)]

    assert allowed == [True] * int(10.0 * BURST_S) + [False] * 5


def test_time_allows_more_but_no_more_than_the_burst() -> None:
    clock = Clock()
    rate_limiter = RateLimiter(10.0, clock=clock)
    while rate_limiter.allow():
        pass
    clock.now_s = 0.35
    assert [rate_limiter.allow() for _ in range(5)] == [True, True, True, False, False]

    clock.now_s = 1000.0
    assert sum(rate_limiter.allow() for _ in range(100)) == 20


def test_what_was_asked_for_may_be_answered() -> None:
    rate_limiter = RateLimiter(1.0, clock=Clock())
    for _ in range(500):
        rate_limiter.credit()
        assert rate_limiter.allow()
    assert [rate_limiter.allow() for _ in range(3)] == [True, True, False]


def test_answers_do_not_add_up_for_ever() -> None:
    rate_limiter = RateLimiter(1.0, clock=Clock())
    for _ in range(2 * MOST_ANSWERS):
        rate_limiter.credit()

    assert sum(rate_limiter.allow() for _ in range(2 * MOST_ANSWERS)) == MOST_ANSWERS + 2


@given(st.floats(1.0, 100.0), st.lists(st.floats(0.0, 1.0, allow_subnormal=False), max_size=200))
def test_no_more_than_the_rate_is_ever_allowed(rate_hz: float, waits_s: list[float]) -> None:
    clock = Clock()
    rate_limiter = RateLimiter(rate_hz, clock=clock)
    allowed = 0
    for wait_s in waits_s:
        clock.now_s += wait_s
        allowed += rate_limiter.allow()

    assert allowed <= rate_hz * (clock.now_s + BURST_S) + 1e-6
